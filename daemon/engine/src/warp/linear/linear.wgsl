// The linear method at full resolution but for (4), the twin of `cpu.rs`, `between.rs` and
// `fill.rs`.

// The cells that are broken.
@group(0) @binding(8) var<storage, read> broken: Listed;
// The pixels of holes that (3) does not show, whose surface is known: `previous.wgsl` may.
@group(0) @binding(9) var<storage, read_write> hidden: List;

// (1) everywhere; what is wrong in broken cells is made anew by `warp_broken`, and only there.
@compute @workgroup_size(16, 16)
fn warp_linear(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if !is_inside(pixel, params.size) {
        return;
    }
    if !is_valid(pixel) {
        write_out(pixel, read_color(pixel));
        return;
    }
    let index = pixel - params.valid_start;
    let p = vec2<i32>(pixel << vec2<u32>(8u));
    write_out(pixel, sample(p - between(place_x(index.x), place_y(index.y))));
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
            write_out(pixel, sample(broken_place(cell, pixel, p)));
        }
    }
}

@compute @workgroup_size(1, 1)
fn count_groups() {
    let groups = groups_of(min(atomicLoad(&hidden.count), arrayLength(&hidden.items)));
    hidden.columns = groups.x;
    hidden.rows = groups.y;
    hidden.layers = 1u;
}

// In which order pixels are listed makes no difference to the picture.
fn list_hidden(pixel: vec2<u32>) {
    let place = atomicAdd(&hidden.count, 1u);
    if place < arrayLength(&hidden.items) {
        hidden.items[place] = pixel.y * params.size.x + pixel.x;
    }
}

// (1): displacement between the four cells around a pixel, first down to its row, then along it.
fn between(x: Place, y: Place) -> vec2<i32> {
    let right = min(x.before + 1u, params.cells.x - 1u);
    let below = min(y.before + 1u, params.cells.y - 1u);
    let left_d = down(x.before, y.before, below, y.way);
    let right_d = down(right, y.before, below, y.way);
    return lerp(left_d, right_d, x.way);
}

fn down(x: u32, above: u32, below: u32, way: i32) -> vec2<i32> {
    let a = displacement(carried[cell_index(vec2<u32>(x, above))]);
    let b = displacement(carried[cell_index(vec2<u32>(x, below))]);
    return lerp(a, b, way);
}

fn lerp(a: vec2<i32>, b: vec2<i32>, way: i32) -> vec2<i32> {
    return a + (((b - a) * way + 128) >> vec2<u32>(8u));
}

// Where in the key a pixel of a broken cell is read: (2), and where that finds nothing, (3) and
// (5).
fn broken_place(cell: vec2<u32>, pixel: vec2<u32>, p: vec2<i32>) -> vec2<i32> {
    let found = find_surface(cell, p);
    if found.is_there {
        return found.place;
    }
    return hole_place(cell, pixel, p);
}

fn hole_place(cell: vec2<u32>, pixel: vec2<u32>, p: vec2<i32>) -> vec2<i32> {
    let far = far_cell(cell);
    if far == NO_CELL {
        return p;
    }
    let source = origin[far];
    let depth = near[source];
    let d = displacement(held[source]);
    // (3)
    var q = clamp_valid(p - d);
    if is_far(q, depth) {
        return far_place(q, depth);
    }
    list_hidden(pixel);
    // (5)
    let half = params.one_cell >> 1u;
    let middle = centre(vec2<u32>(far % params.cells.x, far / params.cells.x));
    q = clamp_valid(clamp(p, middle - half, middle + half) - d);
    if is_far(q, depth) {
        return far_place(q, depth);
    }
    let came_from = centre(vec2<u32>(source % params.cells.x, source / params.cells.x));
    return nearest_pixel(clamp_valid(came_from));
}

// `q` itself where all the pixels around it are far, else the nearest one, which is.
fn far_place(q: vec2<i32>, depth: u32) -> vec2<i32> {
    let low = q & vec2<i32>(~0xff);
    let is_all_far = is_far(clamp_valid(low), depth)
        && is_far(clamp_valid(low + vec2<i32>(256, 0)), depth)
        && is_far(clamp_valid(low + vec2<i32>(0, 256)), depth)
        && is_far(clamp_valid(low + vec2<i32>(256, 256)), depth);
    return select(nearest_pixel(q), q, is_all_far);
}
