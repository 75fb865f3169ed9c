// The picture of a stream into a surface: placed, black around it, converted to what its texels
// stand for. Numbers and formulas are those of sink/srgb.rs.

// Known when the pipeline is made, so that no driver works through what is not needed.
// Texels of the picture: 0 rgba8, 1 rgb10a2, 2 rgba16f.
override FORMAT: u32;
// What they stand for: 0 sRGB codes, 1 light, 2 PQ codes.
override TRANSFER: u32;
// The same of the surface: 0 sRGB codes, 1 clipped light, 2 light, 3 PQ codes.
override ENCODING: u32;
// 1 where codes go over as they are.
override AS_THEY_ARE: u32;

struct Params {
    // Left, top, width and height of the picture in the surface.
    place: vec4<u32>,
    // Columns and rows of the picture.
    size: vec2<u32>,
    // Luminance of 1, cd/m2.
    white: f32,
    unused: u32,
    // The surface's primaries from the picture's, row by row.
    red: vec4<f32>,
    green: vec4<f32>,
    blue: vec4<f32>,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> picture: array<u32>;

// One triangle that covers everything.
@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    return vec4<f32>(corner * 4.0 - 1.0, 0.0, 1.0);
}

// A half of the engine's order as a number; what is not a number is black, infinity the largest.
fn from_ordered(ordered: u32) -> f32 {
    let bits = select(0xffffu - ordered, ordered - 0x8000u, ordered >= 0x8000u);
    let is_special = (bits & 0x7c00u) == 0x7c00u;
    let half = select(bits, (bits & 0x8000u) | 0x7bffu, is_special);
    let number = unpack2x16float(half).x;
    return select(number, 0.0, is_special && (bits & 0x3ffu) != 0u);
}

fn codes_at(index: u32) -> vec3<f32> {
    switch FORMAT {
        case 0u: {
            return unpack4x8unorm(picture[index]).rgb;
        }
        case 1u: {
            let word = picture[index];
            let codes = vec3<u32>(word, word >> 10u, word >> 20u) & vec3<u32>(0x3ffu);
            return vec3<f32>(codes) / 1023.0;
        }
        default: {
            let first = picture[2u * index];
            let blue = picture[2u * index + 1u] & 0xffffu;
            return vec3<f32>(
                from_ordered(first & 0xffffu),
                from_ordered(first >> 16u),
                from_ordered(blue),
            );
        }
    }
}

// IEC 61966-2-1:1999.
fn linear_from_srgb(code: vec3<f32>) -> vec3<f32> {
    let curved = pow((max(code, vec3<f32>(0.0)) + 0.055) / 1.055, vec3<f32>(2.4));
    return select(curved, code / 12.92, code <= vec3<f32>(0.04045));
}

fn srgb_from_linear(light: vec3<f32>) -> vec3<f32> {
    let curved = 1.055 * pow(max(light, vec3<f32>(0.0)), vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(curved, light * 12.92, light <= vec3<f32>(0.0031308));
}

// ST 2084 eq. 4.1 and its inverse, with m1, m2, c1, c2, c3 as there.
const M1: f32 = 2610.0 / 16384.0;
const M2: f32 = 2523.0 / 4096.0 * 128.0;
const C1: f32 = 3424.0 / 4096.0;
const C2: f32 = 2413.0 / 4096.0 * 32.0;
const C3: f32 = 2392.0 / 4096.0 * 32.0;

fn luminance_from_pq(code: vec3<f32>) -> vec3<f32> {
    let power = pow(clamp(code, vec3<f32>(0.0), vec3<f32>(1.0)), vec3<f32>(1.0 / M2));
    let ratio = max(power - C1, vec3<f32>(0.0)) / (C2 - C3 * power);
    return 10000.0 * pow(ratio, vec3<f32>(1.0 / M1));
}

fn pq_from_luminance(luminance: vec3<f32>) -> vec3<f32> {
    let share = clamp(luminance / 10000.0, vec3<f32>(0.0), vec3<f32>(1.0));
    let power = pow(share, vec3<f32>(M1));
    return pow((C1 + C2 * power) / (1.0 + C3 * power), vec3<f32>(M2));
}

// Light, 1 at the stream's white.
fn light_of(code: vec3<f32>) -> vec3<f32> {
    switch TRANSFER {
        case 0u: {
            return linear_from_srgb(code);
        }
        case 1u: {
            return code;
        }
        default: {
            return luminance_from_pq(code) / params.white;
        }
    }
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    // Left of the picture and above it this wraps around, to far beyond.
    let at = vec2<u32>(position.xy) - params.place.xy;
    if any(at >= params.place.zw) {
        return vec4<f32>(0.0, 0.0, 0.0, 1.0);
    }
    let source = at * params.size / params.place.zw;
    let code = codes_at(source.y * params.size.x + source.x);
    if AS_THEY_ARE == 1u {
        return vec4<f32>(code, 1.0);
    }
    var light = light_of(code);
    if ENCODING <= 1u {
        light = clamp(light, vec3<f32>(0.0), vec3<f32>(1.0));
    }
    light = vec3<f32>(
        dot(params.red.xyz, light),
        dot(params.green.xyz, light),
        dot(params.blue.xyz, light),
    );
    switch ENCODING {
        case 0u: {
            let codes = srgb_from_linear(clamp(light, vec3<f32>(0.0), vec3<f32>(1.0)));
            return vec4<f32>(codes, 1.0);
        }
        case 1u, 2u: {
            return vec4<f32>(light, 1.0);
        }
        default: {
            return vec4<f32>(pq_from_luminance(light * params.white), 1.0);
        }
    }
}
