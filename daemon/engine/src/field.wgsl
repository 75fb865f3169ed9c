// The map between pixels and cells of the field grid, from the tables of `field.rs`:
// one word per column of the valid rectangle, one per row; the centres of the cells' columns and of
// their rows; the first pixels of both, and behind each the end. Comes after `color.wgsl` and takes
// binding 3: a shader's own begin at 4.

@group(0) @binding(3) var<storage, read> tables: array<u32>;

struct Place {
    // The cell that holds the pixel.
    cell: u32,
    // The last cell whose centre is not beyond the pixel, and the way to the next one in 1/256.
    before: u32,
    way: i32,
}

fn place_of(word: u32) -> Place {
    let before = word & 0xffffu;
    return Place(before + (word >> 24u), before, bitcast<i32>((word >> 16u) & 0xffu));
}

fn place_x(index: u32) -> Place {
    return place_of(tables[index]);
}

fn place_y(index: u32) -> Place {
    return place_of(tables[params.valid_size.x + index]);
}

// Centre of a cell, Q8 pixels.
fn centre(cell: vec2<u32>) -> vec2<i32> {
    let centres = params.valid_size.x + params.valid_size.y;
    return vec2<i32>(
        bitcast<i32>(tables[centres + cell.x]),
        bitcast<i32>(tables[centres + params.cells.x + cell.y]),
    );
}

// First pixel of a cell and the end, counted from the valid rectangle's first.
struct PixelsOfCell {
    first: vec2<u32>,
    end: vec2<u32>,
}

fn pixels_of(cell: vec2<u32>) -> PixelsOfCell {
    let columns = params.valid_size.x + params.valid_size.y + params.cells.x + params.cells.y;
    let rows = columns + params.cells.x + 1u;
    return PixelsOfCell(
        vec2<u32>(tables[columns + cell.x], tables[rows + cell.y]),
        vec2<u32>(tables[columns + cell.x + 1u], tables[rows + cell.y + 1u]),
    );
}
