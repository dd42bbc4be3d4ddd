//! A module without what it does not need: overrides set, branches on constants folded, what is no longer reached removed.
//!
//! naga does not remove dead branches itself (its maintainers leave that to drivers, wgpu #5608), so their functions and
//! bindings would stay. Folding makes pipelines about ten times cheaper to create, and lets a test without a GPU say what
//! a scene's program does not contain.

use naga::{
    Block, Expression, Function, Handle, Literal, Module, ShaderStage, Statement,
    back::{PipelineConstants, pipeline_constants::process_overrides},
    compact::{KeepUnused, compact},
    valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
};

/// The module could not be specialised. Only a bug in `shaders/` can cause it.
#[derive(Debug, thiserror::Error)]
#[error("the program for kernel `{kernel}` is not valid: {message}")]
pub struct SpecialiseError {
    /// Entry point.
    pub kernel: String,
    /// What naga says.
    pub message: String,
}

/// The part of `module` that `kernel` needs when its overrides have the values `constants`.
///
/// # Errors
/// [`SpecialiseError`] if the result does not validate.
pub fn specialise(
    module: &Module,
    kernel: &str,
    constants: &PipelineConstants,
) -> Result<Module, SpecialiseError> {
    let failed = |message: String| SpecialiseError {
        kernel: kernel.to_owned(),
        message,
    };
    let info = validate(module).map_err(failed)?;
    let (processed, _) = process_overrides(
        module,
        &info,
        Some((ShaderStage::Compute, kernel)),
        constants,
    )
    .map_err(|error| failed(error.to_string()))?;
    let mut module = processed.into_owned();
    fold_module(&mut module);
    compact(&mut module, KeepUnused::No);
    validate(&module).map_err(failed)?;
    Ok(module)
}

/// naga's validation, with the capabilities that our shaders may use: none beyond WGSL's.
///
/// # Errors
/// naga's message with its sources.
pub fn validate(module: &Module) -> Result<ModuleInfo, String> {
    Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(module)
        .map_err(|error| {
            let mut message = error.to_string();
            let mut source = std::error::Error::source(&error);
            while let Some(error) = source {
                message.push_str(": ");
                message.push_str(&error.to_string());
                source = error.source();
            }
            message
        })
}

fn fold_module(module: &mut Module) {
    let constants: Vec<Option<bool>> = module
        .constants
        .iter()
        .map(
            |(_, constant)| match module.global_expressions[constant.init] {
                Expression::Literal(Literal::Bool(value)) => Some(value),
                _ => None,
            },
        )
        .collect();
    let functions = module.functions.iter_mut().map(|(_, function)| function);
    for function in functions.chain(
        module
            .entry_points
            .iter_mut()
            .map(|entry| &mut entry.function),
    ) {
        let body = std::mem::take(&mut function.body);
        // A name keeps its expression alive, and with it the result of a call that folding may have removed.
        function.named_expressions.clear();
        function.body = fold_block(body, function, &constants);
    }
}

/// The block with each `if` on a constant replaced by the branch that is taken, up to where it leaves the block: what
/// comes after `if (HAS_X) { return .. }` is not reached.
fn fold_block(block: Block, function: &Function, constants: &[Option<bool>]) -> Block {
    let mut folded = Block::with_capacity(block.len());
    for (mut statement, span) in block.span_into_iter() {
        if folded.last().is_some_and(Statement::is_terminator) {
            break;
        }
        match &mut statement {
            Statement::If {
                condition,
                accept,
                reject,
            } => {
                let accept = fold_block(std::mem::take(accept), function, constants);
                let reject = fold_block(std::mem::take(reject), function, constants);
                match constant_bool(*condition, function, constants) {
                    Some(true) => folded.extend_block(accept),
                    Some(false) => folded.extend_block(reject),
                    None => folded.push(
                        Statement::If {
                            condition: *condition,
                            accept,
                            reject,
                        },
                        span,
                    ),
                }
                continue;
            }
            Statement::Block(inner) => {
                *inner = fold_block(std::mem::take(inner), function, constants)
            }
            Statement::Loop {
                body, continuing, ..
            } => {
                *body = fold_block(std::mem::take(body), function, constants);
                *continuing = fold_block(std::mem::take(continuing), function, constants);
            }
            Statement::Switch { cases, .. } => {
                for case in cases {
                    case.body = fold_block(std::mem::take(&mut case.body), function, constants);
                }
            }
            _ => {}
        }
        folded.push(statement, span);
    }
    folded
}

fn constant_bool(
    condition: Handle<Expression>,
    function: &Function,
    constants: &[Option<bool>],
) -> Option<bool> {
    match function.expressions[condition] {
        Expression::Literal(Literal::Bool(value)) => Some(value),
        Expression::Constant(constant) => constants[constant.index()],
        Expression::Unary {
            op: naga::UnaryOperator::LogicalNot,
            expr,
        } => constant_bool(expr, function, constants).map(|value| !value),
        _ => None,
    }
}
