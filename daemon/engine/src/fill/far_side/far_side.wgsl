// For each hole the resolved cell on its far side, the twin of `cpu.rs`. Two sweeps note for every
// cell the nearest resolved one on each of its four sides; none of it runs on a grid without holes.

// The source of each resolved cell; of a hole `NO_CELL`, and in the end its far side.
@group(0) @binding(1) var<storage, read_write> origin: array<u32>;
@group(0) @binding(2) var<storage, read> near: array<u32>;
// Nearest resolved row above and below each cell, in the low and the high half of a word.
@group(0) @binding(3) var<storage, read_write> stacked_rows: array<u32>;
// Nearest resolved column left and right of each cell.
@group(0) @binding(4) var<storage, read_write> beside_columns: array<u32>;
@group(0) @binding(5) var<storage, read> holes: Listed;

// No resolved row or column on this side.
const NO_ROW: u32 = 0xffffu;

@compute @workgroup_size(64, 1)
fn sweep_columns(@builtin(global_invocation_id) id: vec3<u32>) {
    if holes.count == 0u || id.x >= params.cells.x {
        return;
    }
    var above = NO_ROW;
    for (var y = 0u; y < params.cells.y; y++) {
        let i = cell_index(vec2<u32>(id.x, y));
        above = select(y, above, origin[i] == NO_CELL);
        stacked_rows[i] = above;
    }
    var below = NO_ROW;
    for (var y = params.cells.y; y > 0u; y--) {
        let i = cell_index(vec2<u32>(id.x, y - 1u));
        below = select(y - 1u, below, origin[i] == NO_CELL);
        stacked_rows[i] |= below << 16u;
    }
}

@compute @workgroup_size(64, 1)
fn sweep_rows(@builtin(global_invocation_id) id: vec3<u32>) {
    if holes.count == 0u || id.x >= params.cells.y {
        return;
    }
    var left = NO_ROW;
    for (var x = 0u; x < params.cells.x; x++) {
        let i = cell_index(vec2<u32>(x, id.x));
        left = select(x, left, origin[i] == NO_CELL);
        beside_columns[i] = left;
    }
    var right = NO_ROW;
    for (var x = params.cells.x; x > 0u; x--) {
        let i = cell_index(vec2<u32>(x - 1u, id.x));
        right = select(x - 1u, right, origin[i] == NO_CELL);
        beside_columns[i] |= right << 16u;
    }
}

// A resolved cell and how far it is from the hole; `NO_CELL` where there is none.
struct Side {
    cell: u32,
    way: u32,
}

// The resolved cells on both sides of a hole along one axis.
struct Sides {
    first: Side,
    second: Side,
}

fn apart(a: u32, b: u32) -> u32 {
    return max(a, b) - min(a, b);
}

fn vertical(hole: vec2<u32>, row: u32) -> Side {
    if row == NO_ROW {
        return Side(NO_CELL, 0u);
    }
    return Side(cell_index(vec2<u32>(hole.x, row)), apart(row, hole.y));
}

fn horizontal(hole: vec2<u32>, column: u32) -> Side {
    if column == NO_ROW {
        return Side(NO_CELL, 0u);
    }
    return Side(cell_index(vec2<u32>(column, hole.y)), apart(column, hole.x));
}

// (1)
fn run(sides: Sides) -> u32 {
    let has_first = sides.first.cell != NO_CELL;
    let has_second = sides.second.cell != NO_CELL;
    if !has_first && !has_second {
        return 0xffffffffu;
    }
    return (sides.first.way + sides.second.way) * select(2u, 1u, has_first && has_second);
}

fn is_open(sides: Sides) -> bool {
    return sides.first.cell == NO_CELL || sides.second.cell == NO_CELL;
}

// (3) of two sides.
fn farther(first: Side, second: Side) -> Side {
    if first.cell == NO_CELL {
        return second;
    }
    if second.cell == NO_CELL {
        return first;
    }
    let a = near[origin[first.cell]];
    let b = near[origin[second.cell]];
    if is_as_near(a, b) && (!is_as_near(b, a) || second.way < first.way) {
        return second;
    }
    return first;
}

@compute @workgroup_size(64, 1)
fn far_side(@builtin(global_invocation_id) id: vec3<u32>) {
    let place = place_in_list(id);
    if place >= holes.count {
        return;
    }
    let i = holes.items[place];
    let hole = vec2<u32>(i % params.cells.x, i / params.cells.x);
    let stacked = Sides(
        vertical(hole, stacked_rows[i] & 0xffffu), vertical(hole, stacked_rows[i] >> 16u),
    );
    let beside = Sides(
        horizontal(hole, beside_columns[i] & 0xffffu), horizontal(hole, beside_columns[i] >> 16u),
    );
    // (2)
    let is_stacked = run(stacked) < run(beside);
    var sides = beside;
    var others = stacked;
    if is_stacked {
        sides = stacked;
        others = beside;
    }
    // (3)
    var far = farther(sides.first, sides.second);
    if is_open(sides) {
        far = farther(far, farther(others.first, others.second));
    }
    origin[i] = far.cell;
}
