// Whether the cells around a target cell agree on their displacement, the twin of `classify` in
// `cpu.rs`.

@group(0) @binding(1) var<storage, read> carried: array<u32>;
@group(0) @binding(2) var<storage, read_write> broken: List;

const LOWEST: i32 = -32768;
// Rows of cells that an invocation goes down, keeping what neighbours share.
const STRIP: u32 = 4u;

struct Range {
    low: vec2<i32>,
    high: vec2<i32>,
}

// Of the velocities of three cells beside each other, two at the edges.
fn range_of_row(x: u32, y: u32) -> Range {
    let left = velocity_of(carried[cell_index(vec2<u32>(max(x, 1u) - 1u, y))]);
    let middle = velocity_of(carried[cell_index(vec2<u32>(x, y))]);
    let right = velocity_of(carried[cell_index(vec2<u32>(min(x + 1u, params.cells.x - 1u), y))]);
    return Range(min(min(left, middle), right), max(max(left, middle), right));
}

@compute @workgroup_size(16, 16)
fn classify(@builtin(global_invocation_id) id: vec3<u32>) {
    let first = id.y * STRIP;
    if id.x >= params.cells.x || first >= params.cells.y {
        return;
    }
    var above = range_of_row(id.x, max(first, 1u) - 1u);
    var here = range_of_row(id.x, first);
    for (var y = first; y < min(first + STRIP, params.cells.y); y++) {
        let below = range_of_row(id.x, min(y + 1u, params.cells.y - 1u));
        let low = min(min(above.low, here.low), below.low);
        let high = max(max(above.high, here.high), below.high);
        // (2). Only a hole has the lowest velocity.
        let ranges = vec2<u32>(high - low);
        let agrees = (low != vec2<i32>(LOWEST)) & (ranges <= vec2<u32>(params.smooth_limit));
        if !all(agrees) {
            // In which order they are listed makes no difference to the picture.
            broken.items[atomicAdd(&broken.count, 1u)] = cell_index(vec2<u32>(id.x, y));
        }
        above = here;
        here = below;
    }
}

// (3)
@compute @workgroup_size(1, 1)
fn count_groups() {
    let groups = groups_of(atomicLoad(&broken.count));
    broken.columns = groups.x;
    broken.rows = groups.y;
    broken.layers = 1u;
}
