// Which surface comes to a pixel, and where the two keys show it: the twin of `cpu.rs`, for both
// shaders. Comes after `holes.wgsl`, whose planes hold the field with its velocities turned round:
// older minus newer position.

// What a pixel shows. Of a hole it is what lies on its far side; none where nothing is resolved.
struct Shown {
    is_there: bool,
    is_hole: bool,
    depth: u32,
    turned: u32,
}

// In a smooth cell: the cell's own source.
fn shown_smooth(cell: vec2<u32>) -> Shown {
    let source = origin[cell_index(cell)];
    return Shown(true, false, near[source], held[source]);
}

// In a broken cell: of the velocities of 3x3 cells that the newest key confirms the nearest, of
// those that are as near the one with the smallest error, and else the far side.
fn shown_broken(cell: vec2<u32>, p: vec2<i32>) -> Shown {
    let first = max(cell, vec2<u32>(1u)) - 1u;
    let end = min(cell + 1u, params.cells - 1u);
    var best = Shown(false, false, 0u, 0u);
    var smallest = 0x7fffffff;
    for (var y = first.y; y <= end.y; y++) {
        for (var x = first.x; x <= end.x; x++) {
            let candidate = carried[cell_index(vec2<u32>(x, y))];
            if candidate == HOLE {
                continue;
            }
            let d = displacement(candidate);
            let surface = surface_at(p - d);
            if !surface.is_there {
                continue;
            }
            let apart = abs(displacement(surface.velocity) - d);
            let error = apart.x + apart.y;
            if error > params.one_cell {
                continue;
            }
            let largest = max(best.depth, surface.depth);
            let is_one = largest - min(best.depth, surface.depth) <= largest >> 8u;
            let is_better = !best.is_there
                || select(surface.depth > best.depth, error < smallest, is_one);
            if is_better {
                best = Shown(true, false, surface.depth, candidate);
                smallest = error;
            }
        }
    }
    if best.is_there {
        return best;
    }
    return far_of_hole(cell);
}

fn far_of_hole(cell: vec2<u32>) -> Shown {
    let far = resolved(cell_index(cell));
    if far == NO_CELL {
        return Shown(false, true, 0u, 0u);
    }
    let source = origin[far];
    return Shown(true, true, near[source], held[source]);
}

// (1): where the newest key shows it.
fn in_newest(p: vec2<i32>, turned: u32) -> vec2<i32> {
    return p - displaced(turned, params.phase);
}
