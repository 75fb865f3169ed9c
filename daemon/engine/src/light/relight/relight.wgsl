// Makes a picture brighter or darker by a gain between tiles, the twin of `cpu.rs`.

// Of the tiles of the valid rectangle, row by row.
@group(0) @binding(3) var<storage, read> gains: array<i32>;

const TILE: u32 = 8u;
const WAYS: i32 = 16;
// Codes of a half float: 0, and the largest that is finite.
const BLACK: i32 = 0x8000;
const BRIGHTEST: i32 = 0xfbff;

fn gain_of(tile: vec2<i32>) -> i32 {
    let size = (params.valid_size + TILE - 1u) / TILE;
    let place = vec2<u32>(clamp(tile, vec2<i32>(0), vec2<i32>(size) - 1));
    return gains[place.y * size.x + place.x];
}

// `between` of the columns on either side.
fn gain_at(index: vec2<u32>) -> i32 {
    let place = 2 * vec2<i32>(index) + 1 - i32(TILE);
    let tile = place >> vec2<u32>(4u);
    let way = place & vec2<i32>(WAYS - 1);
    var columns = vec2<i32>(0);
    for (var x = 0; x < 2; x++) {
        let above = gain_of(tile + vec2<i32>(x, 0));
        let below = gain_of(tile + vec2<i32>(x, 1));
        columns[x] = (WAYS - way.y) * above + way.y * below;
    }
    return ((WAYS - way.x) * columns.x + way.x * columns.y + WAYS * WAYS / 2) >> 8u;
}

fn lit(level: u32, gain: i32) -> u32 {
    if FORMAT == RGBA16F {
        let code = i32(level);
        let moved = clamp(code + gain, BLACK + 1, BRIGHTEST);
        return u32(select(code, moved, code > BLACK && code <= BRIGHTEST));
    }
    let last = select(255u, 1023u, FORMAT == RGB10A2);
    return min((level * u32(gain) + 2048u) >> 12u, last);
}

@compute @workgroup_size(16, 16)
fn relight(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, params.valid_size) {
        return;
    }
    let pixel = params.valid_start + id.xy;
    let index = pixel.y * params.size.x + pixel.x;
    var texel = Texel(out[index], 0u);
    if FORMAT == RGBA16F {
        texel = Texel(out[2u * index], out[2u * index + 1u]);
    }
    let gain = gain_at(id.xy);
    var levels = channels_of(texel);
    for (var channel = 0u; channel < 3u; channel++) {
        levels[channel] = lit(levels[channel], gain);
    }
    write_out(pixel, texel_of(levels));
}
