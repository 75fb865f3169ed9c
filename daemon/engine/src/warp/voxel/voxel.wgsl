// The part of the newest key in a frame between two: what comes to each pixel, where that key shows
// it.

// The cells that are broken.
@group(0) @binding(8) var<storage, read> broken: Listed;

// As if every cell were smooth; what is wrong in broken cells is made anew by `warp_broken`.
@compute @workgroup_size(16, 16)
fn warp_smooth(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if !is_inside(pixel, params.size) {
        return;
    }
    if !is_valid(pixel) {
        write_out(pixel, read_color(pixel));
        return;
    }
    let index = pixel - params.valid_start;
    let cell = vec2<u32>(place_x(index.x).cell, place_y(index.y).cell);
    if carried[cell_index(cell)] == HOLE {
        return;
    }
    let p = vec2<i32>(pixel << vec2<u32>(8u));
    write_out(pixel, sample(in_newest(p, shown_smooth(cell).turned)));
}

// An invocation for each broken cell.
@compute @workgroup_size(64, 1)
fn warp_broken(@builtin(global_invocation_id) id: vec3<u32>) {
    let place = place_in_list(id);
    if place >= broken.count {
        return;
    }
    let i = broken.items[place];
    let cell = vec2<u32>(i % params.cells.x, i / params.cells.x);
    let pixels = pixels_of(cell);
    for (var y = pixels.first.y; y < pixels.end.y; y++) {
        for (var x = pixels.first.x; x < pixels.end.x; x++) {
            let pixel = params.valid_start + vec2<u32>(x, y);
            let p = vec2<i32>(pixel << vec2<u32>(8u));
            write_out(pixel, sample(in_newest(p, shown_broken(cell, p).turned)));
        }
    }
}
