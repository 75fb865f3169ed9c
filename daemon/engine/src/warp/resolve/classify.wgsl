// Whether the cells around a target cell agree on their displacement, the twin of `classify` in
// `cpu.rs`.

@group(0) @binding(1) var<storage, read> carried: array<u32>;
// The groups of a dispatch over the broken cells (3), their number, and from word 4 on the cells.
@group(0) @binding(2) var<storage, read_write> broken: array<atomic<u32>>;

const LOWEST: i32 = -32768;

@compute @workgroup_size(16, 16)
fn classify(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = id.xy;
    if !is_inside(cell, params.cells) {
        return;
    }
    let first = max(cell, vec2<u32>(1u)) - 1u;
    let last = min(cell + 1u, params.cells - 1u);
    var low = velocity_of(carried[cell_index(cell)]);
    var high = low;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let v = velocity_of(carried[cell_index(vec2<u32>(x, y))]);
            low = min(low, v);
            high = max(high, v);
        }
    }
    // (2). Only a hole has the lowest velocity.
    let ranges = vec2<u32>(high - low);
    let agrees = (low != vec2<i32>(LOWEST)) & (ranges <= vec2<u32>(params.smooth_limit));
    if !all(agrees) {
        // In which order they are listed makes no difference to the picture.
        let place = atomicAdd(&broken[3], 1u);
        atomicStore(&broken[4u + place], cell_index(cell));
    }
}

@compute @workgroup_size(1, 1)
fn count_groups() {
    let groups = (atomicLoad(&broken[3]) + BROKEN_GROUP - 1u) / BROKEN_GROUP;
    atomicStore(&broken[0], min(groups, GROUPS_OF_A_ROW));
    atomicStore(&broken[1], (groups + GROUPS_OF_A_ROW - 1u) / GROUPS_OF_A_ROW);
    atomicStore(&broken[2], 1u);
}
