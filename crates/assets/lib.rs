//! Writes the small scenes of assets/
