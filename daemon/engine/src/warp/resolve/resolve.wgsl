// From splats to the velocity and the source that each target cell shows, the twin of `cpu.rs`.

@group(0) @binding(1) var<storage, read> held: array<u32>;
@group(0) @binding(2) var<storage, read> splat: array<u32>;
@group(0) @binding(3) var<storage, read_write> carried: array<u32>;
@group(0) @binding(4) var<storage, read_write> origin: array<u32>;
@group(0) @binding(5) var<storage, read_write> holes: array<u32>;

@compute @workgroup_size(16, 16)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, params.cells) {
        return;
    }
    let i = cell_index(id.xy);
    // (1)
    if splat[i] == NO_SOURCE {
        carried[i] = HOLE;
        origin[i] = NO_CELL;
        // Every invocation that writes, writes the same.
        holes[0] = 1u;
        return;
    }
    let source = splat[i] & MAX_CELLS;
    carried[i] = held[source];
    origin[i] = source;
}
