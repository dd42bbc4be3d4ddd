//! The picture: tone mapping, PNG and EXR, error metrics
