//! HOW it is rendered: device, program, upload, dispatches, read-back
