//! What a naga module says about itself.

use std::collections::BTreeSet;

use naga::{Block, Expression, Function, Handle, Literal, Module, Statement};

/// Every statement of a block, inner blocks included.
pub fn walk(block: &Block, visit: &mut dyn FnMut(&Statement)) {
    for statement in block {
        visit(statement);
        match statement {
            Statement::Block(inner) => walk(inner, visit),
            Statement::If { accept, reject, .. } => {
                walk(accept, visit);
                walk(reject, visit);
            }
            Statement::Switch { cases, .. } => {
                cases.iter().for_each(|case| walk(&case.body, visit))
            }
            Statement::Loop {
                body, continuing, ..
            } => {
                walk(body, visit);
                walk(continuing, visit);
            }
            _ => {}
        }
    }
}

/// Every function, entry points included.
pub fn functions(module: &Module) -> impl Iterator<Item = &Function> {
    let entries = module.entry_points.iter().map(|entry| &entry.function);
    module
        .functions
        .iter()
        .map(|(_, function)| function)
        .chain(entries)
}

/// In how many places `function` calls `callee`.
fn calls(function: &Function, callee: Handle<Function>) -> usize {
    let mut count = 0;
    walk(&function.body, &mut |statement| {
        count += usize::from(
            matches!(statement, Statement::Call { function, .. } if *function == callee),
        );
    });
    count
}

fn function_called(module: &Module, name: &str) -> Option<Handle<Function>> {
    let is_it = |function: &Function| function.name.as_deref() == Some(name);
    module
        .functions
        .iter()
        .find(|(_, function)| is_it(function))
        .map(|(handle, _)| handle)
}

/// In how many places of the module a function is called; `None` if there is no such function.
pub fn call_sites(module: &Module, name: &str) -> Option<usize> {
    let callee = function_called(module, name)?;
    Some(functions(module).map(|caller| calls(caller, callee)).sum())
}

/// How often a function's code is in a program whose calls are all inlined: its call sites, each as often as its caller is.
pub fn copies(module: &Module, name: &str) -> Option<usize> {
    function_called(module, name).map(|callee| copies_of(module, callee))
}

fn copies_of(module: &Module, callee: Handle<Function>) -> usize {
    let entries: usize = module
        .entry_points
        .iter()
        .map(|entry| calls(&entry.function, callee))
        .sum();
    let inner = module
        .functions
        .iter()
        .map(|(caller, function)| match calls(function, callee) {
            0 => 0,
            count => count * copies_of(module, caller),
        });
    entries + inner.sum::<usize>()
}

/// Names of all functions and of all global variables, bindings included.
pub fn names(module: &Module) -> BTreeSet<String> {
    let globals = module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| variable.name.clone());
    functions(module)
        .filter_map(|function| function.name.clone())
        .chain(globals)
        .collect()
}

/// How much code there is: expressions and statements.
pub fn size(module: &Module) -> usize {
    functions(module)
        .map(|function| {
            let mut statements = 0;
            walk(&function.body, &mut |_| statements += 1);
            statements + function.expressions.len()
        })
        .sum()
}

/// Branches whose condition is known.
pub fn constant_branches(module: &Module) -> usize {
    let mut count = 0;
    for function in functions(module) {
        walk(&function.body, &mut |statement| {
            if let Statement::If { condition, .. } = statement {
                let known = matches!(
                    function.expressions[*condition],
                    Expression::Constant(_) | Expression::Literal(_)
                );
                count += usize::from(known);
            }
        });
    }
    count
}

/// The value of a WGSL constant, as its bits.
pub fn constant(module: &Module, name: &str) -> u32 {
    let found = module
        .constants
        .iter()
        .find(|(_, constant)| constant.name.as_deref() == Some(name));
    let (_, constant) = found.unwrap_or_else(|| panic!("shaders/ has no constant {name}"));
    match module.global_expressions[constant.init] {
        Expression::Literal(Literal::U32(value)) => value,
        Expression::Literal(Literal::F32(value)) => value.to_bits(),
        ref other => panic!("{name} is no number: {other:?}"),
    }
}
