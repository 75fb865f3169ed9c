// Pixels whose channels are integers: `color.rs` and `warp/sample.rs` in the same words.
// A pixel is one word, or two of `RGBA16F`. Takes bindings 1 and 2: a shader's own begin at 3.

@group(0) @binding(1) var<storage, read> color: array<u32>;
@group(0) @binding(2) var<storage, read_write> out: array<u32>;

override FORMAT: u32 = 0u;

const RGBA8: u32 = 0u;
const RGB10A2: u32 = 1u;
const RGBA16F: u32 = 2u;

// A pixel as it is stored; the second word is used by `RGBA16F` alone.
alias Texel = vec2<u32>;

fn channels_of(texel: Texel) -> vec4<u32> {
    if FORMAT == RGBA16F {
        return vec4<u32>(
            texel.x & 0xffffu, texel.x >> 16u, texel.y & 0xffffu, texel.y >> 16u,
        );
    }
    if FORMAT == RGB10A2 {
        return (vec4<u32>(texel.x) >> vec4<u32>(0u, 10u, 20u, 30u))
            & vec4<u32>(0x3ffu, 0x3ffu, 0x3ffu, 0x3u);
    }
    return (vec4<u32>(texel.x) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(0xffu);
}

fn texel_of(channels: vec4<u32>) -> Texel {
    if FORMAT == RGBA16F {
        return Texel(channels.x | (channels.y << 16u), channels.z | (channels.w << 16u));
    }
    var shifts = vec4<u32>(0u, 8u, 16u, 24u);
    if FORMAT == RGB10A2 {
        shifts = vec4<u32>(0u, 10u, 20u, 30u);
    }
    let parts = channels << shifts;
    return Texel(parts.x | parts.y | parts.z | parts.w, 0u);
}

fn read_color(pixel: vec2<u32>) -> Texel {
    let index = pixel.y * params.size.x + pixel.x;
    if FORMAT == RGBA16F {
        return Texel(color[2u * index], color[2u * index + 1u]);
    }
    return Texel(color[index], 0u);
}

fn write_out(pixel: vec2<u32>, texel: Texel) {
    let index = pixel.y * params.size.x + pixel.x;
    if FORMAT == RGBA16F {
        out[2u * index] = texel.x;
        out[2u * index + 1u] = texel.y;
    } else {
        out[index] = texel.x;
    }
}

// (sum of weight * corner + 32768) >> 16 per channel. Weights sum to 65536 and a channel has 16
// bits, so the sum stays inside a u32.
fn bilinear(corners: array<Texel, 4>, fx: u32, fy: u32) -> Texel {
    let gx = 256u - fx;
    let gy = 256u - fy;
    let sum = channels_of(corners[0]) * (gx * gy)
        + channels_of(corners[1]) * (fx * gy)
        + channels_of(corners[2]) * (gx * fy)
        + channels_of(corners[3]) * (fx * fy);
    return texel_of((sum + 32768u) >> vec4<u32>(16u));
}

// (a * (256 - weight) + b * weight + 128) >> 8 per channel.
fn mix_texels(a: Texel, b: Texel, weight: u32) -> Texel {
    let sum = channels_of(a) * (256u - weight) + channels_of(b) * weight;
    return texel_of((sum + 128u) >> vec4<u32>(8u));
}

// The Q8 position clamped to the pixel centres of the valid rectangle.
fn clamp_valid(q: vec2<i32>) -> vec2<i32> {
    return clamp_within(q, params.valid_start, params.valid_size);
}

// The same for any rectangle.
fn clamp_within(q: vec2<i32>, start: vec2<u32>, size: vec2<u32>) -> vec2<i32> {
    let first = vec2<i32>(start << vec2<u32>(8u));
    let last = vec2<i32>((start + size - 1u) << vec2<u32>(8u));
    return clamp(q, first, last);
}

// The key's colour at a Q8 position, bilinear, clamped to the pixel centres of the valid rectangle.
fn sample(q: vec2<i32>) -> Texel {
    return sample_within(q, params.valid_start, params.valid_size);
}

// The same for any rectangle inside the plane.
fn sample_within(q: vec2<i32>, start: vec2<u32>, size: vec2<u32>) -> Texel {
    let clamped = vec2<u32>(clamp_within(q, start, size));
    let low = clamped >> vec2<u32>(8u);
    let high = min(low + 1u, start + size - 1u);
    let corners = array<Texel, 4>(
        read_color(low),
        read_color(vec2<u32>(high.x, low.y)),
        read_color(vec2<u32>(low.x, high.y)),
        read_color(high),
    );
    return bilinear(corners, clamped.x & 0xffu, clamped.y & 0xffu);
}
