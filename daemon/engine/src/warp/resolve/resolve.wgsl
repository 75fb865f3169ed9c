// From splats to the velocity and the source that each target cell shows, the twin of `cpu.rs`.

@group(0) @binding(1) var<storage, read> held: array<u32>;
@group(0) @binding(2) var<storage, read> splat: array<u32>;
@group(0) @binding(3) var<storage, read_write> carried: array<u32>;
@group(0) @binding(4) var<storage, read_write> origin: array<u32>;
@group(0) @binding(5) var<storage, read_write> holes: List;

@compute @workgroup_size(16, 16)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, params.cells) {
        return;
    }
    let i = cell_index(id.xy);
    let candidate = ~splat[i];
    // (1)
    if candidate == NO_SOURCE {
        carried[i] = HOLE;
        origin[i] = NO_CELL;
        list(i);
        return;
    }
    let source = candidate & MAX_CELLS;
    carried[i] = held[source];
    origin[i] = source;
}

// In which order cells are listed makes no difference to the picture.
fn list(i: u32) {
    holes.items[atomicAdd(&holes.count, 1u)] = i;
}

@compute @workgroup_size(1, 1)
fn count_groups() {
    let groups = groups_of(atomicLoad(&holes.count));
    holes.columns = groups.x;
    holes.rows = groups.y;
    holes.layers = 1u;
}
