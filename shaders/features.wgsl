// What a program can contain. The host sets each override from the scene and the settings (crates/gpu/program.rs), folds
// `if (HAS_X)` away and drops what is no longer reachable. Write uses as `if (HAS_X) { if (cond) { .. } }`: naga lowers
// `HAS_X && cond` to a variable, which can't be folded.

override HAS_ORTHOGRAPHIC: bool = true;       // the camera's rays are parallel
override HAS_CULLING: bool = true;            // some material is single-sided
override HAS_MASK: bool = true;               // alpha cuts holes
override HAS_BLEND: bool = true;              // alpha is coverage
override HAS_UNLIT: bool = true;              // KHR_materials_unlit
override HAS_TEXTURES: bool = true;           // some material samples an image
override HAS_NORMAL_MAPS: bool = true;        // .. for its shading normal
override HAS_VERTEX_COLORS: bool = true;      // COLOR_0
override HAS_BRANCHES: bool = true;         // some surface spawns rays: reflected, transmitted or past alpha
override HAS_REFLECTION: bool = true;         // some surface spawns reflected rays
override HAS_TRANSMISSION: bool = true;       // some surface lets light through
override HAS_SOLIDS: bool = true;             // .. and bounds a solid: rays refract and carry media
override HAS_ABSORPTION: bool = true;         // .. that absorbs
override HAS_PRIORITIES: bool = true;         // .. some with more right to the place where they overlap than others
override HAS_CONTACT: bool = true;            // .. with faces that coincide with those of others
override HAS_STRAIGHT_ON: bool = true;        // some ray goes on behind a surface as it came: a shadow ray, or any ray in solids
override HAS_TRANSPARENT_SHADOWS: bool = true; // something between a point and a light may let part of it through
override HAS_LIGHTS: bool = true;             // punctual lights
override HAS_MANY_LIGHTS: bool = true;        // .. more than one
override HAS_ENVIRONMENT: bool = true;        // an environment map
override HAS_WHITTED: bool = true;            // shading model: eq. 14.32; else glTF's
override HAS_INSTANCES: bool = true;          // meshes that several nodes share: instances.wgsl
override HAS_LONG_RAYS: bool = true;          // a single ray may do more than a dispatch should: it goes on in the next one
override HAS_TOLERANCE: bool = true;          // samples may be ordered one by one, and what can't matter is left out: tolerance.wgsl
override HAS_COUNTERS: bool = true;           // statistics

// Numerics: what every picture has, left out only to measure what it does and costs (settings.rs, Numerics).
override HAS_WATERTIGHT: bool = true;         // edge functions that neighbours share; else Moeller and Trumbore 1997
override HAS_PADDED_BOXES: bool = true;       // boxes widened by the rounding of their test
override HAS_ERROR_BOUNDS: bool = true;       // rays start off the surface by its error; else hits below a tolerance are ignored (Foley 14.7)
