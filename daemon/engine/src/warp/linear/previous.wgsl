// Holes that one of the keys before shows (4), the twin of `previous.rs`: over the picture that
// `linear.wgsl` and the keys after that one made, with the colour of that key. `LEVEL`, a part of the
// text of its own, says which key it is, counted from 0.

// Of some keys in turn: depth keys, then how far the cells came since the key before.
@group(0) @binding(8) var<storage, read> was: array<u32>;
// Pixels of holes that the newest key does not show, whose surface is known.
@group(0) @binding(9) var<storage, read> hidden: Listed;

const DEPTH_SHIFT: u32 = 5u;
const MOST_KEYS: u32 = 4u;
const REACH: i32 = 16;
const STEADY: i32 = 16;

// An invocation for each pixel of a hole that the newest key does not show.
@compute @workgroup_size(64, 1)
fn fill_from_previous(@builtin(global_invocation_id) id: vec3<u32>) {
    let place = place_in_list(id);
    if place >= min(hidden.count, arrayLength(&hidden.items)) {
        return;
    }
    let i = hidden.items[place];
    let pixel = vec2<u32>(i % params.size.x, i / params.size.x);
    let index = pixel - params.valid_start;
    let cell = vec2<u32>(place_x(index.x).cell, place_y(index.y).cell);
    let far = far_cell(cell);
    let way = way_of(cell, far);
    if way.count <= LEVEL {
        return;
    }
    let p = vec2<i32>(pixel << vec2<u32>(8u));
    let q = p - displacement(held[origin[far]]);
    if is_first_seen(way, q) {
        write_out(pixel, sample(unmixed(q - way.totals[LEVEL], way.depths[LEVEL])));
    }
}

// Where a far surface was in the keys before: how far it came since, Q8 pixels, and its depth key.
struct Way {
    totals: array<vec2<i32>, MOST_KEYS>,
    depths: array<u32, MOST_KEYS>,
    count: u32,
}

// (a) and (b), as far as this key.
fn way_of(cell: vec2<u32>, far: u32) -> Way {
    var way: Way;
    let source = origin[far];
    let from_centre = centre(vec2<u32>(source % params.cells.x, source / params.cells.x));
    let far_centre = centre(vec2<u32>(far % params.cells.x, far / params.cells.x));
    let step = away(far_centre - centre(cell));
    var total = vec2<i32>(0, 0);
    var depth = near[source];
    var came = came_to(0u, source);
    for (var key = 0u; key <= LEVEL; key++) {
        if came == HOLE {
            break;
        }
        total += velocity_of(came) * 8;
        way.totals[key] = total;
        way.depths[key] = depth;
        way.count = key + 1u;
        if key == LEVEL {
            break;
        }
        let seen = in_sight(key, depth, from_centre - total, step);
        if seen == NO_CELL {
            break;
        }
        depth = depth_in(key, seen);
        came = came_to(key + 1u, seen);
        let apart = abs(velocity_of(came) - velocity_of(came_to(0u, source)));
        if max(apart.x, apart.y) > STEADY {
            break;
        }
    }
    return way;
}

// The cell, from `start` on by steps of `step`, where a key shows a surface of depth key `depth`,
// and did a step before, `NO_CELL` where what is farther, or the border, comes first.
fn in_sight(key: u32, depth: u32, start: vec2<i32>, step: vec2<i32>) -> u32 {
    let before = cell_at(start - step);
    var was_same = before != NO_CELL && is_same(depth_in(key, before), depth);
    for (var i = 0; i <= REACH; i++) {
        let cell = cell_at(start + i * step);
        if cell == NO_CELL {
            return NO_CELL;
        }
        let here = depth_in(key, cell);
        let is_its = is_same(here, depth);
        if is_its && was_same {
            return cell;
        }
        if !is_its && here < depth {
            return NO_CELL;
        }
        was_same = is_its;
    }
    return NO_CELL;
}

// A cell's step on beyond the far side, along the axis in which that lies farther apart from the
// hole, down among equals.
fn away(apart: vec2<i32>) -> vec2<i32> {
    if abs(apart.x) > abs(apart.y) {
        return vec2<i32>(sign(apart.x) * params.one_cell, 0);
    }
    return vec2<i32>(0, sign(apart.y) * params.one_cell);
}

// Whether this key shows what the newest would at `q`, and every one after it something nearer.
fn is_first_seen(way: Way, q: vec2<i32>) -> bool {
    for (var key = 0u; key < LEVEL; key++) {
        let cell = cell_at(q - way.totals[key]);
        if cell == NO_CELL {
            return false;
        }
        let depth = depth_in(key, cell);
        if depth < way.depths[key] || is_same(depth, way.depths[key]) {
            return false;
        }
    }
    return shows(LEVEL, q - way.totals[LEVEL], way.depths[LEVEL]);
}

// Where the field of a key is: key 0 is the newest.
fn field_of(key: u32) -> u32 {
    let place = (params.newest_field + params.held_fields - key) % params.held_fields;
    return place * 2u * params.cells.x * params.cells.y;
}

// How far a cell came since key `key` of those before, to the one after that.
fn came_to(key: u32, cell: u32) -> u32 {
    return was[field_of(key) + params.cells.x * params.cells.y + cell];
}

// The depth key of a cell in key `key` of those before.
fn depth_in(key: u32, cell: u32) -> u32 {
    return was[field_of(key + 1u) + cell];
}

// The cell that holds the pixel nearest to `q`; `NO_CELL` outside.
fn cell_at(q: vec2<i32>) -> u32 {
    // Left of or above the rectangle the difference wraps and is larger than any size.
    let index = vec2<u32>((q + 128) >> vec2<u32>(8u)) - params.valid_start;
    if !is_inside(index, params.valid_size) {
        return NO_CELL;
    }
    return cell_index(vec2<u32>(place_x(index.x).cell, place_y(index.y).cell));
}

// Whether depth keys of two keys are of one surface.
fn is_same(a: u32, b: u32) -> bool {
    let largest = max(a, b);
    return largest - min(a, b) <= (largest >> DEPTH_SHIFT) + 1u;
}

// Whether a key shows a surface of depth key `depth` at the pixel nearest to `q`.
fn shows(key: u32, q: vec2<i32>, depth: u32) -> bool {
    let cell = cell_at(q);
    return cell != NO_CELL && is_same(depth_in(key, cell), depth);
}

// `q` itself where all the pixels around it are of that surface, else the nearest one, which is.
fn unmixed(q: vec2<i32>, depth: u32) -> vec2<i32> {
    let low = q & vec2<i32>(~0xff);
    let is_one = shows(LEVEL, clamp_valid(low), depth)
        && shows(LEVEL, clamp_valid(low + vec2<i32>(256, 0)), depth)
        && shows(LEVEL, clamp_valid(low + vec2<i32>(0, 256)), depth)
        && shows(LEVEL, clamp_valid(low + vec2<i32>(256, 256)), depth);
    return select(nearest_pixel(q), q, is_one);
}
