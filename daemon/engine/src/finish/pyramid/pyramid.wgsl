// The blur of a picture, the twin of `cpu.rs`: reads `out`, over the valid rectangle.

@group(0) @binding(3) var<storage, read_write> half_level: array<u32>;
@group(0) @binding(4) var<storage, read_write> quarter_level: array<u32>;
@group(0) @binding(5) var<storage, read_write> smooth_level: array<u32>;

fn half_size() -> vec2<u32> {
    return (params.valid_size + 1u) >> vec2<u32>(1u);
}

fn quarter_size() -> vec2<u32> {
    return (half_size() + 1u) >> vec2<u32>(1u);
}

// The nearest place inside a plane of this size.
fn inside(at: vec2<i32>, size: vec2<u32>) -> vec2<u32> {
    return vec2<u32>(clamp(at, vec2<i32>(0), vec2<i32>(size) - 1));
}

fn picture_at(at: vec2<i32>) -> vec4<u32> {
    let pixel = params.valid_start + inside(at, params.valid_size);
    let index = pixel.y * params.size.x + pixel.x;
    if FORMAT == RGBA16F {
        return channels_of(Texel(out[2u * index], out[2u * index + 1u]));
    }
    return channels_of(Texel(out[index], 0u));
}

fn half_at(at: vec2<i32>) -> vec4<u32> {
    let place = inside(at, half_size());
    let index = place.y * half_size().x + place.x;
    if FORMAT == RGBA16F {
        return channels_of(Texel(half_level[2u * index], half_level[2u * index + 1u]));
    }
    return channels_of(Texel(half_level[index], 0u));
}

fn quarter_at(at: vec2<i32>) -> vec4<u32> {
    let place = inside(at, quarter_size());
    let index = place.y * quarter_size().x + place.x;
    if FORMAT == RGBA16F {
        return channels_of(Texel(quarter_level[2u * index], quarter_level[2u * index + 1u]));
    }
    return channels_of(Texel(quarter_level[index], 0u));
}

// Weights of three pixels beside each other: 1 2 1.
fn down_weight(tap: i32) -> u32 {
    return select(1u, 2u, tap == 0);
}

// Weights of a coarse pixel and its neighbours for the fine ones: 1 6 1 for even, 0 4 4 for odd.
fn up_weight(tap: i32, fine: u32) -> u32 {
    if (fine & 1u) == 0u {
        return select(1u, 6u, tap == 0);
    }
    return select(4u, 0u, tap < 0);
}

// (1)
@compute @workgroup_size(16, 16)
fn down_to_half(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, half_size()) {
        return;
    }
    var sum = vec4<u32>(8u);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let weight = down_weight(x) * down_weight(y);
            sum += weight * picture_at(2 * vec2<i32>(id.xy) + vec2<i32>(x, y));
        }
    }
    let texel = texel_of(sum >> vec4<u32>(4u));
    let index = id.y * half_size().x + id.x;
    if FORMAT == RGBA16F {
        half_level[2u * index] = texel.x;
        half_level[2u * index + 1u] = texel.y;
    } else {
        half_level[index] = texel.x;
    }
}

// (2)
@compute @workgroup_size(16, 16)
fn down_to_quarter(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, quarter_size()) {
        return;
    }
    var sum = vec4<u32>(8u);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let weight = down_weight(x) * down_weight(y);
            sum += weight * half_at(2 * vec2<i32>(id.xy) + vec2<i32>(x, y));
        }
    }
    let texel = texel_of(sum >> vec4<u32>(4u));
    let index = id.y * quarter_size().x + id.x;
    if FORMAT == RGBA16F {
        quarter_level[2u * index] = texel.x;
        quarter_level[2u * index + 1u] = texel.y;
    } else {
        quarter_level[index] = texel.x;
    }
}

// (4)
@compute @workgroup_size(16, 16)
fn up_to_half(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, half_size()) {
        return;
    }
    let middle = vec2<i32>(id.xy >> vec2<u32>(1u));
    var sum = vec4<u32>(32u);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let weight = up_weight(x, id.x) * up_weight(y, id.y);
            sum += weight * quarter_at(middle + vec2<i32>(x, y));
        }
    }
    let texel = texel_of(sum >> vec4<u32>(6u));
    let index = id.y * half_size().x + id.x;
    if FORMAT == RGBA16F {
        smooth_level[2u * index] = texel.x;
        smooth_level[2u * index + 1u] = texel.y;
    } else {
        smooth_level[index] = texel.x;
    }
}
