// Forward splat on the field grid in two passes, the twin of `one_by_one.rs`. Which invocation
// comes first does not matter: the largest depth key and the smallest candidate are the same in any
// order. Candidates are kept with every bit turned over, so that cleared memory is `NO_SOURCE`.

@group(0) @binding(1) var<storage, read> held: array<u32>;
@group(0) @binding(2) var<storage, read> near: array<u32>;
@group(0) @binding(3) var<storage, read_write> top: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> splat: array<atomic<u32>>;

// Where a source cell lands: the target cell left of and above it, and the way there in 1/256.
struct Landing {
    cell: vec2<i32>,
    way: vec2<u32>,
}

// (1)
fn landing(cell: vec2<u32>) -> Landing {
    let moved = (velocity_of(held[cell_index(cell)]) * params.cell_scale + 256) >> vec2<u32>(9u);
    let target_q8 = vec2<i32>(cell << vec2<u32>(8u)) + moved;
    return Landing(target_q8 >> vec2<u32>(8u), vec2<u32>(target_q8 & vec2<i32>(0xff)));
}

// Corner 0 to 3 of the 2x2 footprint. Its index, or `NO_CELL` where it lies outside or the splat
// does not reach it.
fn corner_index(land: Landing, corner: u32) -> u32 {
    let step = vec2<u32>(corner & 1u, corner >> 1u);
    let cell = vec2<u32>(land.cell + vec2<i32>(step));
    if any((step == vec2<u32>(1u)) & (land.way == vec2<u32>(0u))) || !is_inside(cell, params.cells) {
        return NO_CELL;
    }
    return cell_index(cell);
}

@compute @workgroup_size(16, 16)
fn scatter_top(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, params.cells) {
        return;
    }
    let land = landing(id.xy);
    let depth = near[cell_index(id.xy)];
    for (var corner = 0u; corner < 4u; corner++) {
        let i = corner_index(land, corner);
        if i != NO_CELL {
            // (2)
            atomicMax(&top[i], depth);
        }
    }
}

@compute @workgroup_size(16, 16)
fn scatter_splat(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, params.cells) {
        return;
    }
    let land = landing(id.xy);
    let source = cell_index(id.xy);
    let depth = near[source];
    for (var corner = 0u; corner < 4u; corner++) {
        let i = corner_index(land, corner);
        if i != NO_CELL && is_as_near(depth, atomicLoad(&top[i])) {
            // (4)
            let step = vec2<u32>(corner & 1u, corner >> 1u);
            let ways = select(land.way, 256u - land.way, step == vec2<u32>(1u));
            let distance = (ways.x + ways.y) >> 2u;
            // (3)
            atomicMax(&splat[i], ~((distance << SOURCE_BITS) | source));
        }
    }
}
