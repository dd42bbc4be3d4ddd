// How the scene is read. It lies in storage textures rather than in storage buffers: for a load from a buffer at an address that
// differs by lane lavapipe writes a branch for each lane and component, for a texel it calls one function for all lanes. Programs
// compile three times faster and traverse three times faster (benches/README.md; sampled textures lie between); and a table may
// be larger than a storage binding's 128 MiB. Entries lie row by row.

const TABLE_WIDTH: u32 = 8192u;

fn table_place(index: u32) -> vec2u {
    return vec2u(index % TABLE_WIDTH, index / TABLE_WIDTH);
}

fn node_word(index: u32) -> vec4u {
    return textureLoad(nodes, table_place(index));
}

fn leaf_vertex_word(index: u32) -> vec4f {
    return bitcast<vec4f>(textureLoad(leaf_vertices, table_place(index)));
}

fn leaf_triangle(leaf: u32) -> LeafTriangle {
    let word = textureLoad(leaf_triangles, table_place(leaf));
    return LeafTriangle(word.xyz, word.w);
}

fn leaf_material(leaf: u32) -> u32 {
    return textureLoad(leaf_materials, table_place(leaf)).x;
}

fn leaf_node(leaf: u32) -> u32 {
    return textureLoad(leaf_nodes, table_place(leaf)).x;
}

// A vertex's texel number `word`; see Frame.
fn vertex_word(vertex: u32, word: u32) -> vec4f {
    return bitcast<vec4f>(textureLoad(attributes, table_place(vertex * frame.vertex_words + word)));
}

fn environment_color(index: u32) -> vec3f {
    return bitcast<vec3f>(textureLoad(environment, table_place(index)).xyz);
}

fn decode_srgb(code: u32) -> f32 {
    return decoded_srgb[code / 4u][code % 4u];
}

const MATERIAL_WORDS: u32 = 8u;

fn material_word(material: u32, word: u32) -> vec4u {
    return textureLoad(materials, table_place(material * MATERIAL_WORDS + word));
}

// What is not used of it is not read, and what the scene has not is not there.
fn load_material(material: u32) -> Material {
    let emissive = bitcast<vec4f>(material_word(material, 1u));
    let specular = bitcast<vec4f>(material_word(material, 2u));
    let lobe = bitcast<vec4f>(material_word(material, 3u));
    let rest = material_word(material, 4u);
    var loaded: Material;
    loaded.base_color = bitcast<vec4f>(material_word(material, 0u));
    loaded.emissive = emissive.xyz;
    if (HAS_MASK) {
        loaded.alpha_cutoff = emissive.w;
    }
    loaded.specular_color = specular.xyz;
    loaded.specular = specular.w;
    loaded.metallic = lobe.x;
    loaded.roughness = lobe.y;
    loaded.transmission = lobe.z;
    loaded.ior = lobe.w;
    if (HAS_NORMAL_MAPS) {
        loaded.normal_scale = bitcast<f32>(rest.x);
    }
    loaded.occlusion_strength = bitcast<f32>(rest.y);
    loaded.flags = rest.z;
    if (HAS_SOLIDS) {
        loaded.medium = rest.w;
    }
    if (HAS_WHITTED) {
        let book_s = bitcast<vec4f>(material_word(material, 5u));
        let book_t = bitcast<vec4f>(material_word(material, 6u));
        loaded.whitted_ks = book_s.xyz;
        loaded.whitted_n = book_s.w;
        loaded.whitted_kt = book_t.xyz;
        loaded.whitted_ka = book_t.w;
        loaded.whitted_kd = bitcast<f32>(material_word(material, 7u).x);
    }
    return loaded;
}

const TEXTURE_USE_WORDS: u32 = 3u;

fn texture_use_word(material: u32, which: u32, word: u32) -> vec4u {
    return textureLoad(texture_uses, table_place((material * MATERIAL_TEXTURES + which) * TEXTURE_USE_WORDS + word));
}

// TextureUse.offset
fn texture_offset(material: u32, which: u32) -> u32 {
    return texture_use_word(material, which, 0u).w;
}

fn load_texture_use(material: u32, which: u32) -> TextureUse {
    let u = texture_use_word(material, which, 0u);
    let v = texture_use_word(material, which, 1u);
    let size = texture_use_word(material, which, 2u);
    return TextureUse(bitcast<vec3f>(u.xyz), u.w, bitcast<vec3f>(v.xyz), v.w, size.x, size.y, size.z, 0u);
}

const LIGHT_WORDS: u32 = 4u;

fn light_word(light: u32, word: u32) -> vec4u {
    return textureLoad(lights, table_place(light * LIGHT_WORDS + word));
}

fn load_light(light: u32) -> Light {
    let place = light_word(light, 0u);
    let axis = bitcast<vec4f>(light_word(light, 1u));
    let power = bitcast<vec4f>(light_word(light, 2u));
    let rest = bitcast<vec4f>(light_word(light, 3u));
    return Light(bitcast<vec3f>(place.xyz), place.w, axis.xyz, axis.w, power.xyz, power.w, rest.x, rest.y, 0u, 0u);
}
