// Whether the cells around a target cell agree on their displacement, the twin of `classify` in
// `cpu.rs`.

@group(0) @binding(1) var<storage, read> carried: array<u32>;
@group(0) @binding(2) var<storage, read_write> broken: array<u32>;

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
    broken[cell_index(cell)] = select(1u, 0u, all(agrees));
}
