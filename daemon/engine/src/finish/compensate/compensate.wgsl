// From a picture and its blur to a key or an in-between frame, the twin of `cpu.rs` and of the
// integer arithmetic of `foreframe_perception::compensation`.

@group(0) @binding(3) var<storage, read> smooth_level: array<u32>;
// Light by channel and level; then by channel and level the light from which on the next one is
// nearer.
@group(0) @binding(4) var<storage, read> lights: array<u32>;

// How far tiles are blurred, four to a word, row by row.
@group(0) @binding(5) var<storage, read> weights: array<u32>;

const TILE: u32 = 8u;
const FULL: u32 = 128u;
const FULL_LIGHT: u32 = 0x1000000u;

fn smooth_at(at: vec2<i32>) -> vec4<u32> {
    let size = (params.valid_size + 1u) >> vec2<u32>(1u);
    let place = vec2<u32>(clamp(at, vec2<i32>(0), vec2<i32>(size) - 1));
    let index = place.y * size.x + place.x;
    if FORMAT == RGBA16F {
        return channels_of(Texel(smooth_level[2u * index], smooth_level[2u * index + 1u]));
    }
    return channels_of(Texel(smooth_level[index], 0u));
}

// As in `pyramid.wgsl`.
fn up_weight(tap: i32, fine: u32) -> u32 {
    if (fine & 1u) == 0u {
        return select(1u, 6u, tap == 0);
    }
    return select(4u, 0u, tap < 0);
}

fn blur_at(index: vec2<u32>) -> vec4<u32> {
    let middle = vec2<i32>(index >> vec2<u32>(1u));
    var sum = vec4<u32>(32u);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let weight = up_weight(x, index.x) * up_weight(y, index.y);
            sum += weight * smooth_at(middle + vec2<i32>(x, y));
        }
    }
    return sum >> vec4<u32>(6u);
}

fn tile_weight(at: vec2<i32>) -> u32 {
    let size = (params.valid_size + TILE - 1u) / TILE;
    let place = vec2<u32>(clamp(at, vec2<i32>(0), vec2<i32>(size) - 1));
    let index = place.y * size.x + place.x;
    return (weights[index >> 2u] >> (8u * (index & 3u))) & 0xffu;
}

// How far a pixel is blurred: `row_weights`.
fn weight_at(index: vec2<u32>) -> u32 {
    let place = 2 * vec2<i32>(index) + 1 - i32(TILE);
    let tile = place >> vec2<u32>(4u);
    let way = vec2<u32>(place & vec2<i32>(15));
    var columns = vec2<u32>(0u);
    for (var x = 0; x < 2; x++) {
        let above = tile_weight(tile + vec2<i32>(x, 0));
        let below = tile_weight(tile + vec2<i32>(x, 1));
        columns[x] = (16u - way.y) * above + way.y * below;
    }
    return ((16u - way.x) * columns.x + way.x * columns.y + 128u) >> 8u;
}

// (0)
fn mixed(original: vec4<u32>, blurred: vec4<u32>, weight: u32) -> vec4<u32> {
    return ((FULL - weight) * original + weight * blurred + FULL / 2u) >> vec4<u32>(7u);
}

fn light_of(channel: u32, level: u32) -> u32 {
    return lights[channel * params.levels + level];
}

// The level whose light is nearest: how many borders are not above it.
fn level_of(channel: u32, light: u32) -> u32 {
    let borders = (3u + channel) * params.levels;
    var low = 0u;
    var high = params.levels - 1u;
    while low < high {
        let middle = (low + high) >> 1u;
        if lights[borders + middle] <= light {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

// (2)
fn in_between(channel: u32, original: u32, blurred: u32) -> u32 {
    let others = params.frames - 1u;
    let light = light_of(channel, original);
    let total = params.frames * light;
    // (1)
    var least = (max(total, FULL_LIGHT) - FULL_LIGHT + (others >> 1u)) / others;
    var most = min((total + (others >> 1u)) / others, FULL_LIGHT);
    least = max(least, light - min(light, params.most_step));
    most = min(most, light + params.most_step);
    let wanted = light_of(channel, blurred);
    if wanted > most {
        return level_of(channel, most);
    }
    if wanted < least {
        return level_of(channel, least);
    }
    return blurred;
}

// (3)
fn key(channel: u32, original: u32, between: u32) -> u32 {
    if between == original {
        return original;
    }
    let total = params.frames * light_of(channel, original);
    let paid = (params.frames - 1u) * light_of(channel, between);
    return level_of(channel, min(max(total, paid) - paid, FULL_LIGHT));
}

@compute @workgroup_size(16, 16)
fn compensate(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, params.valid_size) {
        return;
    }
    let pixel = params.valid_start + id.xy;
    let index = pixel.y * params.size.x + pixel.x;
    var texel = Texel(out[index], 0u);
    if FORMAT == RGBA16F {
        texel = Texel(out[2u * index], out[2u * index + 1u]);
    }
    var levels = channels_of(texel);
    var blurred = blur_at(id.xy);
    if params.is_selective == 1u {
        blurred = mixed(levels, blurred, weight_at(id.xy));
    }
    for (var channel = 0u; channel < 3u; channel++) {
        let between = in_between(channel, levels[channel], blurred[channel]);
        if params.is_key == 1u {
            levels[channel] = key(channel, levels[channel], between);
        } else {
            levels[channel] = between;
        }
    }
    write_out(pixel, texel_of(levels));
}
