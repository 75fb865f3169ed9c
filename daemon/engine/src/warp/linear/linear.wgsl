// The linear method at full resolution, the twin of `cpu.rs`, `between.rs`, `broken.rs` and
// `fill.rs`.

// Of the key, as the scatter read them.
@group(0) @binding(4) var<storage, read> held: array<u32>;
@group(0) @binding(5) var<storage, read> near: array<u32>;
// Of the cells of this frame: velocity, source or far side of a hole, and which are broken.
@group(0) @binding(6) var<storage, read> carried: array<u32>;
@group(0) @binding(7) var<storage, read> origin: array<u32>;
@group(0) @binding(8) var<storage, read> broken: ListedCells;

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
    let i = broken.cells[place];
    let cell = vec2<u32>(i % params.cells.x, i / params.cells.x);
    let pixels = pixels_of(cell);
    for (var y = pixels.first.y; y < pixels.end.y; y++) {
        for (var x = pixels.first.x; x < pixels.end.x; x++) {
            let pixel = params.valid_start + vec2<u32>(x, y);
            let p = vec2<i32>(pixel << vec2<u32>(8u));
            write_out(pixel, sample(broken_place(cell, p)));
        }
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

// The surface that the key shows at the pixel nearest to a place; none outside.
struct Surface {
    is_there: bool,
    depth: u32,
    velocity: u32,
}

fn surface_at(q: vec2<i32>) -> Surface {
    // Left of or above the rectangle the difference wraps and is larger than any size.
    let index = vec2<u32>((q + 128) >> vec2<u32>(8u)) - params.valid_start;
    if !is_inside(index, params.valid_size) {
        return Surface(false, 0u, 0u);
    }
    let i = cell_index(vec2<u32>(place_x(index.x).cell, place_y(index.y).cell));
    return Surface(true, near[i], held[i]);
}

// Where in the key a pixel of a broken cell is read: (2), and where that finds nothing, (3) and (4).
fn broken_place(cell: vec2<u32>, p: vec2<i32>) -> vec2<i32> {
    let first = max(cell, vec2<u32>(1u)) - 1u;
    let end = min(cell + 1u, params.cells - 1u);
    // Of candidates that come to p: where they are in the key, their depth and error.
    var places: array<vec2<i32>, 9>;
    var depths: array<u32, 9>;
    var errors: array<i32, 9>;
    var count = 0u;
    var nearest = 0u;
    for (var y = first.y; y <= end.y; y++) {
        for (var x = first.x; x <= end.x; x++) {
            let velocity = carried[cell_index(vec2<u32>(x, y))];
            let d = displacement(velocity);
            let surface = surface_at(p - d);
            let apart = abs(displacement(surface.velocity) - d);
            let error = apart.x + apart.y;
            if velocity != HOLE && surface.is_there && error <= params.one_cell {
                places[count] = p - d;
                depths[count] = surface.depth;
                errors[count] = error;
                nearest = max(nearest, surface.depth);
                count++;
            }
        }
    }
    var best = p;
    var smallest = 0x7fffffff;
    for (var i = 0u; i < count; i++) {
        if is_as_near(depths[i], nearest) && errors[i] < smallest {
            best = places[i];
            smallest = errors[i];
        }
    }
    if count > 0u {
        return best;
    }
    return hole_place(cell, p);
}

fn hole_place(cell: vec2<u32>, p: vec2<i32>) -> vec2<i32> {
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
    // (4)
    let half = params.one_cell >> 1u;
    let middle = centre(vec2<u32>(far % params.cells.x, far / params.cells.x));
    q = clamp_valid(clamp(p, middle - half, middle + half) - d);
    if is_far(q, depth) {
        return far_place(q, depth);
    }
    let came_from = centre(vec2<u32>(source % params.cells.x, source / params.cells.x));
    return nearest_pixel(clamp_valid(came_from));
}

fn nearest_pixel(q: vec2<i32>) -> vec2<i32> {
    return (q + 128) & vec2<i32>(~0xff);
}

// The resolved cell that a cell shows or continues.
fn resolved(i: u32) -> u32 {
    return select(i, origin[i], carried[i] == HOLE);
}

// The cell that a hole pixel continues: the far side of its own cell if that is a hole, else the
// farthest surface in 3x3 around it, the first in reading order among equals.
fn far_cell(cell: vec2<u32>) -> u32 {
    let i = cell_index(cell);
    if carried[i] == HOLE {
        return origin[i];
    }
    let first = max(cell, vec2<u32>(1u)) - 1u;
    let end = min(cell + 1u, params.cells - 1u);
    var farthest = NO_CELL;
    var depth = 0u;
    for (var y = first.y; y <= end.y; y++) {
        for (var x = first.x; x <= end.x; x++) {
            let other = resolved(cell_index(vec2<u32>(x, y)));
            if other == NO_CELL {
                continue;
            }
            let other_depth = near[origin[other]];
            if farthest == NO_CELL || other_depth < depth {
                farthest = other;
                depth = other_depth;
            }
        }
    }
    return farthest;
}

// Whether the key shows at the pixel nearest to `q` nothing nearer than `depth`.
fn is_far(q: vec2<i32>, depth: u32) -> bool {
    let surface = surface_at(q);
    return surface.is_there && is_as_near(depth, surface.depth);
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
