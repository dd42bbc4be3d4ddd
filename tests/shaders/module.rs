//! What a naga module says about itself.

use std::collections::BTreeSet;

use naga::{
    BinaryOperator, Block, Expression, Function, Handle, Literal, Module, Statement, Type,
    TypeInner, valid::FunctionInfo,
};
use raytree_gpu::specialise::validate;

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

/// What a program is made of, as text:
/// - `name`: a function or a global variable, bindings included;
/// - `Struct.member`: read or written somewhere. (A struct keeps its members where nothing reads them: its layout is the host's.)
/// - `caller -> callee`: a call;
/// - `& 0x4`, and `Struct.member & 0x4` where that is what it is taken of: a test of bits;
/// - `function: Normalize`: a builtin, by naga's name.
pub fn parts(module: &Module) -> BTreeSet<String> {
    let info = validate(module).expect("it was validated when it was assembled");
    let mut found = names(module);
    let called = module
        .functions
        .iter()
        .map(|(handle, function)| (function, &info[handle]));
    let entries = module
        .entry_points
        .iter()
        .enumerate()
        .map(|(index, entry)| (&entry.function, info.get_entry_point(index)));
    for (function, info) in called.chain(entries) {
        let name = function.name.as_deref().unwrap_or_default();
        let body = Body {
            module,
            function,
            info,
        };
        walk(&function.body, &mut |statement| {
            if let Statement::Call { function, .. } = statement {
                let callee = module.functions[*function].name.as_deref();
                found.insert(format!("{name} -> {}", callee.unwrap_or_default()));
            }
        });
        for (handle, expression) in function.expressions.iter() {
            found.extend(body.member(handle));
            match *expression {
                Expression::Math { fun, .. } => {
                    found.insert(format!("{name}: {fun:?}"));
                }
                Expression::Binary {
                    op: BinaryOperator::And,
                    left,
                    right,
                } => found.extend(body.test_of_bits(left, right)),
                _ => {}
            }
        }
    }
    found
}

/// A function with the types of its expressions.
struct Body<'a> {
    module: &'a Module,
    function: &'a Function,
    info: &'a FunctionInfo,
}

impl Body<'_> {
    /// `Struct.member`, if that is what the expression is, or what it is loaded from.
    fn member(&self, handle: Handle<Expression>) -> Option<String> {
        match self.function.expressions[handle] {
            Expression::Load { pointer } => self.member(pointer),
            Expression::AccessIndex { base, index } => {
                let container = self.info[base].ty.inner_with(&self.module.types);
                member(self.module, container, index)
            }
            _ => None,
        }
    }

    fn test_of_bits(&self, left: Handle<Expression>, right: Handle<Expression>) -> Vec<String> {
        let literal = match self.function.expressions[right] {
            Expression::Constant(constant) => {
                let init = self.module.constants[constant].init;
                &self.module.global_expressions[init]
            }
            ref other => other,
        };
        let Expression::Literal(Literal::U32(bits)) = *literal else {
            return Vec::new();
        };
        let test = format!("& {bits:#x}");
        let of_member = self.member(left).map(|member| format!("{member} {test}"));
        of_member.into_iter().chain([test]).collect()
    }
}

/// The member of a struct, or of what a pointer to a struct points to.
fn member(module: &Module, container: &TypeInner, index: u32) -> Option<String> {
    let named = |handle: Handle<Type>| {
        let found = &module.types[handle];
        match &found.inner {
            TypeInner::Struct { members, .. } => {
                let member = members[index as usize].name.as_ref()?;
                Some(format!("{}.{member}", found.name.as_ref()?))
            }
            _ => None,
        }
    };
    match container {
        TypeInner::Pointer { base, .. } => named(*base),
        // A value: the type of this shape, which has one name only.
        TypeInner::Struct { .. } => module
            .types
            .iter()
            .find(|(_, candidate)| candidate.inner == *container)
            .and_then(|(handle, _)| named(handle)),
        _ => None,
    }
}
