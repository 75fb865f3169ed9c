// Holes that the key before shows (4), the twin of `previous.rs`: over the picture that
// `linear.wgsl` made, with the colour of that key.

// Depth keys of the key before, then how far the cells of the newest came since.
@group(0) @binding(8) var<storage, read> was: array<u32>;

const DEPTH_SHIFT: u32 = 5u;

// An invocation for each cell.
@compute @workgroup_size(16, 16)
fn fill_from_previous(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = id.xy;
    if !is_inside(cell, params.cells) || !is_broken(cell) {
        return;
    }
    let far = far_cell(cell);
    if far == NO_CELL {
        return;
    }
    let source = origin[far];
    let depth = near[source];
    let d = displacement(held[source]);
    let came = was[params.cells.x * params.cells.y + source];
    if came == HOLE {
        return;
    }
    let pixels = pixels_of(cell);
    for (var y = pixels.first.y; y < pixels.end.y; y++) {
        for (var x = pixels.first.x; x < pixels.end.x; x++) {
            let pixel = params.valid_start + vec2<u32>(x, y);
            let p = vec2<i32>(pixel << vec2<u32>(8u));
            let q = p - d - velocity_of(came) * 8;
            if shows(q, depth) && !find_surface(cell, p).is_there
                && !is_far(clamp_valid(p - d), depth) {
                write_out(pixel, sample(unmixed(q, depth)));
            }
        }
    }
}

// Whether the key before shows a surface of depth key `depth` at the pixel nearest to `q`.
fn shows(q: vec2<i32>, depth: u32) -> bool {
    // Left of or above the rectangle the difference wraps and is larger than any size.
    let index = vec2<u32>((q + 128) >> vec2<u32>(8u)) - params.valid_start;
    if !is_inside(index, params.valid_size) {
        return false;
    }
    let then = was[cell_index(vec2<u32>(place_x(index.x).cell, place_y(index.y).cell))];
    let largest = max(then, depth);
    return largest - min(then, depth) <= (largest >> DEPTH_SHIFT) + 1u;
}

// `q` itself where all the pixels around it are of that surface, else the nearest one, which is.
fn unmixed(q: vec2<i32>, depth: u32) -> vec2<i32> {
    let low = q & vec2<i32>(~0xff);
    let is_one = shows(clamp_valid(low), depth)
        && shows(clamp_valid(low + vec2<i32>(256, 0)), depth)
        && shows(clamp_valid(low + vec2<i32>(0, 256)), depth)
        && shows(clamp_valid(low + vec2<i32>(256, 256)), depth);
    return select(nearest_pixel(q), q, is_one);
}
