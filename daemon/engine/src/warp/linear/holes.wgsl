// What pixels of broken cells show, the twin of `broken.rs` and `fill.rs`, for shaders that read
// the cells of a frame. Takes bindings 4 to 7: a shader's own begins at 8.

// Of the key, as the scatter read them.
@group(0) @binding(4) var<storage, read> held: array<u32>;
@group(0) @binding(5) var<storage, read> near: array<u32>;
// Of the cells of this frame: velocity, and source or far side of a hole.
@group(0) @binding(6) var<storage, read> carried: array<u32>;
@group(0) @binding(7) var<storage, read> origin: array<u32>;

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

// Where in the key the surface is that comes to a pixel of a broken cell (2), if one does.
struct Found {
    is_there: bool,
    place: vec2<i32>,
}

fn find_surface(cell: vec2<u32>, p: vec2<i32>) -> Found {
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
    return Found(count > 0u, best);
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

// Whether the cells around one do not agree, the rule of `classify.wgsl`.
fn is_broken(cell: vec2<u32>) -> bool {
    let first = max(cell, vec2<u32>(1u)) - 1u;
    let end = min(cell + 1u, params.cells - 1u);
    var low = velocity_of(carried[cell_index(cell)]);
    var high = low;
    for (var y = first.y; y <= end.y; y++) {
        for (var x = first.x; x <= end.x; x++) {
            let word = carried[cell_index(vec2<u32>(x, y))];
            if word == HOLE {
                return true;
            }
            low = min(low, velocity_of(word));
            high = max(high, velocity_of(word));
        }
    }
    return !all(vec2<u32>(high - low) <= vec2<u32>(params.smooth_limit));
}
