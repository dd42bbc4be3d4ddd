//! The independent judge: the same equation, recursive, in f64, as in the book
