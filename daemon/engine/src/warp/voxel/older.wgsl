// The part of the older key in a frame between two, over the picture that `voxel.wgsl` made; what is
// called colour here is the older key's.

// Depth keys of the older key, then for its columns and rows of pixels which cells hold them.
@group(0) @binding(8) var<storage, read> was: array<u32>;

const SAME_SURFACE_SHIFT: u32 = 3u;

// An invocation for each cell.
@compute @workgroup_size(16, 16)
fn add_older(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = id.xy;
    if !is_inside(cell, params.cells) {
        return;
    }
    let is_smooth = !is_broken(cell);
    let pixels = pixels_of(cell);
    for (var y = pixels.first.y; y < pixels.end.y; y++) {
        for (var x = pixels.first.x; x < pixels.end.x; x++) {
            let pixel = params.valid_start + vec2<u32>(x, y);
            let p = vec2<i32>(pixel << vec2<u32>(8u));
            if is_smooth {
                add(pixel, p, shown_smooth(cell));
            } else {
                add(pixel, p, shown_broken(cell, p));
            }
        }
    }
}

fn add(pixel: vec2<u32>, p: vec2<i32>, shown: Shown) {
    let q = p + displaced(shown.turned, params.ahead);
    let then = older_at(q);
    if shown.is_hole {
        // (4)
        let is_hidden = shown.is_there && then.is_known
            && then.depth - (then.depth >> SAME_SURFACE_SHIFT) > shown.depth;
        if !is_hidden {
            write_out(pixel, sample_older(q));
        }
        return;
    }
    // (3)
    let largest = max(then.depth, shown.depth);
    let is_same = !then.is_known
        || largest - min(then.depth, shown.depth) <= largest >> SAME_SURFACE_SHIFT;
    if then.is_inside && is_same {
        write_out(pixel, mix_texels(read_out(pixel), sample_older(q), params.older_weight));
    }
}

fn sample_older(q: vec2<i32>) -> Texel {
    return sample_within(q, params.older_start, params.older_size);
}

fn read_out(pixel: vec2<u32>) -> Texel {
    let index = pixel.y * params.size.x + pixel.x;
    if FORMAT == RGBA16F {
        return Texel(out[2u * index], out[2u * index + 1u]);
    }
    return Texel(out[index], 0u);
}

// What the older key shows at the pixel nearest to a place.
struct Then {
    is_inside: bool,
    is_known: bool,
    depth: u32,
}

fn older_at(q: vec2<i32>) -> Then {
    // Left of or above the rectangle the difference wraps and is larger than any size.
    let index = vec2<u32>((q + 128) >> vec2<u32>(8u)) - params.older_start;
    let is_inside = is_inside(index, params.older_size);
    if !is_inside || params.compares_depth == 0u {
        return Then(is_inside, false, 0u);
    }
    let places = params.older_cells.x * params.older_cells.y;
    let cell = vec2<u32>(
        place_of(was[places + index.x]).cell,
        place_of(was[places + params.older_size.x + index.y]).cell,
    );
    return Then(true, true, was[cell.y * params.older_cells.x + cell.x]);
}
