// What every shader shares: the parameters of a frame, and the integer arithmetic of
// `params.rs`, `key.rs`, `warp/mod.rs`, `field.rs` in the same words.
//
// Shaders use integers alone. An `i32` shifted right rounds towards minus infinity, here as in
// Rust.

struct FrameParams {
    size: vec2<u32>,
    valid_start: vec2<u32>,
    valid_size: vec2<u32>,
    cells: vec2<u32>,
    cell_scale: vec2<i32>,
    phase: i32,
    smooth_limit: u32,
    one_cell: i32,
    has_depth: u32,
    mesh_cells: vec2<u32>,
    frames: u32,
    is_key: u32,
    levels: u32,
    most_step: u32,
    is_selective: u32,
    compares_depth: u32,
    older_start: vec2<u32>,
    older_size: vec2<u32>,
    older_cells: vec2<u32>,
    ahead: i32,
    older_weight: u32,
    held_fields: u32,
    newest_field: u32,
}

@group(0) @binding(0) var<uniform> params: FrameParams;

// A velocity is two i16 in one word, x in the low half.
const HOLE: u32 = 0x80008000u;
const NO_SOURCE: u32 = 0xffffffffu;
const NO_CELL: u32 = 0xffffffffu;
const SOURCE_BITS: u32 = 25u;
const MAX_CELLS: u32 = 0x1ffffffu;
// Listed items of a workgroup, and workgroups of a row of them.
const LIST_GROUP: u32 = 64u;
const GROUPS_OF_A_ROW: u32 = 1024u;

// Some cells of the grid or some pixels, in any order: the workgroups of a dispatch over them, how
// many they are, and their indices.
struct List {
    columns: u32,
    rows: u32,
    layers: u32,
    count: atomic<u32>,
    items: array<u32>,
}

// The same where it is only read.
struct Listed {
    columns: u32,
    rows: u32,
    layers: u32,
    count: u32,
    items: array<u32>,
}

fn groups_of(count: u32) -> vec2<u32> {
    let groups = (count + LIST_GROUP - 1u) / LIST_GROUP;
    return vec2<u32>(min(groups, GROUPS_OF_A_ROW), (groups + GROUPS_OF_A_ROW - 1u) / GROUPS_OF_A_ROW);
}

// Which of the listed items an invocation of the dispatch is for.
fn place_in_list(id: vec3<u32>) -> u32 {
    return id.y * GROUPS_OF_A_ROW * LIST_GROUP + id.x;
}

fn velocity_of(word: u32) -> vec2<i32> {
    return vec2<i32>(bitcast<i32>(word << 16u) >> 16u, bitcast<i32>(word) >> 16u);
}

// Displacement of a velocity after the phase, Q8 pixels; 0 where none is known.
fn displacement(word: u32) -> vec2<i32> {
    if word == HOLE {
        return vec2<i32>(0, 0);
    }
    return displaced(word, params.phase);
}

// The same after any phase, of a velocity that is known.
fn displaced(word: u32, phase: i32) -> vec2<i32> {
    return (velocity_of(word) * phase + 256) >> vec2<u32>(9u, 9u);
}

fn cell_index(cell: vec2<u32>) -> u32 {
    return cell.y * params.cells.x + cell.x;
}

fn is_inside(at: vec2<u32>, size: vec2<u32>) -> bool {
    return all(at < size);
}

fn is_valid(pixel: vec2<u32>) -> bool {
    // Left of or above the rectangle the difference wraps and is larger than any size.
    return is_inside(pixel - params.valid_start, params.valid_size);
}

// Whether a surface of depth key `depth` is as near as one of `other`, to 1/256.
fn is_as_near(depth: u32, other: u32) -> bool {
    return depth >= other - (other >> 8u);
}
