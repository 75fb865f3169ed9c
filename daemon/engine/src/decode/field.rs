//! Depth and motion planes onto the field grid.

use rayon::ThreadPool;

use super::camera::{CameraMotion, ProjectionDepth};
use super::depth::{DepthToKey, clip_depth, stored_depth};
use super::error::DecodeError;
use super::geometry::CheckedPlane;
use super::motion::{pixels_per_unit, stored_motion};
use super::{CheckedKey, size};
use crate::bands::for_each_row;
use crate::format::{self, DepthFormat, DepthMeaning, MotionFormat, StreamFormat};
use crate::key::{Camera, KeyInput};
use crate::plane::{Plane, Rect};
use crate::warp::scatter::MAX_CELLS;

/// The depth and motion planes of one key and the grid that they go to.
pub(super) struct FieldInput<'a> {
    pool: &'a ThreadPool,
    format: &'a StreamFormat,
    depth: Option<CheckedPlane<'a>>,
    motion: Option<CheckedPlane<'a>>,
    projection: Option<ProjectionDepth>,
    cameras: Option<(Camera, Camera)>,
    /// Cells per row and column.
    cells: [u32; 2],
    /// Of the cells, in cells: a cell of centre c shows the image at c + jitter.
    jitter: [f32; 2],
    color: CheckedPlane<'a>,
    image: Rect,
}

impl<'a> FieldInput<'a> {
    pub(super) fn new(
        format: &'a StreamFormat,
        input: &KeyInput<'_>,
        planes: &CheckedKey<'a>,
        projection: Option<ProjectionDepth>,
        image: Rect,
        pool: &'a ThreadPool,
    ) -> Result<Self, DecodeError> {
        let both = [planes.depth, planes.motion];
        let finest = |length: fn(&Rect) -> u32| {
            both.iter().flatten().map(|plane| length(&plane.valid)).max().unwrap_or(0)
        };
        let cells = [finest(|valid| valid.width), finest(|valid| valid.height)];
        let [width, height] = cells;
        if width * height > MAX_CELLS {
            return Err(DecodeError::FieldSize { max: MAX_CELLS, width, height });
        }
        // The jitter of the first plane that has the grid's resolution along the axis.
        let jitter_of = |axis: usize, length: fn(&Rect) -> u32| {
            let plane = both.iter().flatten().find(|plane| length(&plane.valid) == cells[axis]);
            plane.map_or(0.0, |plane| plane.jitter[axis])
        };
        let jitter = [jitter_of(0, |valid| valid.width), jitter_of(1, |valid| valid.height)];
        let cameras = input.motion_from_camera.zip(input.camera);
        Ok(Self {
            pool,
            format,
            depth: planes.depth,
            motion: planes.motion,
            projection,
            cameras,
            cells,
            jitter,
            color: planes.color,
            image,
        })
    }

    /// Offset of the samples in cells: a cell of centre c shows the image at c + jitter.
    pub(super) fn jitter(&self) -> [f32; 2] {
        self.jitter
    }

    pub(super) fn has_depth(&self) -> bool {
        self.depth.is_some()
    }

    /// How far right and down of its even place a cell lies on the output, Q8 pixels.
    #[expect(clippy::cast_precision_loss, reason = "sizes up to 8192 are exact")]
    #[expect(clippy::cast_possible_truncation, reason = "float to int casts saturate")]
    pub(super) fn offset(&self) -> [i32; 2] {
        let (image, valid) = (size(self.image), size(self.color.valid));
        std::array::from_fn(|axis| {
            let cell_px = image[axis] / self.cells[axis].max(1) as f32;
            let color_px = image[axis] / valid[axis];
            let offset = self.jitter[axis] * cell_px - self.color.jitter[axis] * color_px;
            libm::roundf(offset * 256.0) as i32
        })
    }

    /// Which of `samples` is nearest to the centre of each cell along an axis.
    #[expect(clippy::cast_possible_truncation, reason = "clamped to the plane")]
    #[expect(clippy::cast_sign_loss, reason = "float to int casts saturate at 0")]
    fn nearest(&self, axis: usize, samples: u32, jitter: f32, out: &mut Vec<u16>) {
        let ratio = f64::from(samples) / f64::from(self.cells[axis]);
        let shift = f64::from(self.jitter[axis]);
        out.clear();
        out.extend((0..self.cells[axis]).map(|cell| {
            let centre = (f64::from(cell) + 0.5 + shift) * ratio - f64::from(jitter);
            // 2^-20 of a sample: far more than rounding adds, far less than any real offset.
            let sample = (centre + 1.0 / 1_048_576.0) as u32;
            sample.min(samples - 1) as u16
        }));
    }

    /// Fills `columns` with the sample of each column and row of the grid.
    fn tables(&self, plane: &CheckedPlane<'_>, columns: &mut [Vec<u16>; 2]) {
        self.nearest(0, plane.valid.width, plane.jitter[0], &mut columns[0]);
        self.nearest(1, plane.valid.height, plane.jitter[1], &mut columns[1]);
    }

    /// Depth keys of the grid, and the meaning that the projection contradicts the stream with.
    pub(super) fn decode_depth(
        &self,
        columns: &mut [Vec<u16>; 2],
        keys: &mut Plane<u32>,
    ) -> Option<DepthMeaning> {
        let (plane, convention) = self.depth.zip(self.format.depth)?;
        let (to_key, contradiction) = DepthToKey::new(convention.meaning, self.projection);
        self.tables(&plane, columns);
        let [columns, rows] = &*columns;
        let is_own = is_own_sample(columns, &plane);
        keys.resize(self.cells[0], self.cells[1]);
        // One loop per format and its bytes: the compiler then sees a constant format inside it.
        macro_rules! read {
            ($format:expr, $bytes:literal) => {
                for_each_row(
                    self.pool,
                    keys,
                    #[inline(always)]
                    |y, out| {
                        plane.with_valid_row(
                            u32::from(rows[y as usize]),
                            #[inline(always)]
                            |row| {
                                if is_own {
                                    let (texels, _) = row.as_chunks::<$bytes>();
                                    let stored =
                                        texels.iter().map(|texel| stored_depth($format, texel, 0));
                                    return to_key.write_keys(stored, out);
                                }
                                let stored = columns
                                    .iter()
                                    .map(|&x| stored_depth($format, row, usize::from(x)));
                                to_key.write_keys(stored, out);
                            },
                        );
                    },
                )
            };
        }
        match convention.format {
            DepthFormat::F32 => read!(DepthFormat::F32, 4),
            DepthFormat::F16 => read!(DepthFormat::F16, 2),
            DepthFormat::U16 => read!(DepthFormat::U16, 2),
            DepthFormat::U24 => read!(DepthFormat::U24, 4),
        }
        contradiction
    }

    /// Codes of the classes of the grid's cells; none without a mask or a grid.
    pub(super) fn decode_mask(
        &self,
        plane: Option<&CheckedPlane<'_>>,
        columns: &mut [Vec<u16>; 2],
        mask: &mut Plane<u8>,
    ) {
        let Some(plane) = plane.filter(|_| !self.cells.contains(&0)) else {
            return mask.resize(0, 0);
        };
        self.tables(plane, columns);
        let [columns, rows] = &*columns;
        mask.resize(self.cells[0], self.cells[1]);
        for_each_row(
            self.pool,
            mask,
            #[inline(always)]
            |y, out| {
                plane.with_valid_row(
                    u32::from(rows[y as usize]),
                    #[inline(always)]
                    |row| {
                        for (class, &x) in out.iter_mut().zip(columns) {
                            *class = row[usize::from(x)];
                        }
                    },
                );
            },
        );
    }

    /// 1 / distance along the view axis of a depth key of 1, where that is known.
    pub(super) fn inverse_distance_per_depth_key(&self) -> Option<f32> {
        let convention = self.depth.and(self.format.depth)?;
        let (to_key, _) = DepthToKey::new(convention.meaning, self.projection);
        to_key.inverse_distance_per_key(self.projection)
    }

    /// Displacements of the grid in output pixels; NaN where none is known.
    pub(super) fn decode_motion(
        &self,
        columns: &mut [Vec<u16>; 2],
        out: &mut Plane<[f32; 2]>,
    ) -> Result<(), DecodeError> {
        let Some((plane, convention)) = self.motion.zip(self.format.motion) else {
            return Ok(());
        };
        let factor = pixels_per_unit(&convention, size(self.image), size(self.color.valid))?;
        self.tables(&plane, columns);
        let [table, rows] = &*columns;
        let is_own = is_own_sample(table, &plane);
        out.resize(self.cells[0], self.cells[1]);
        macro_rules! read {
            ($format:expr, $bytes:literal) => {
                for_each_row(
                    self.pool,
                    out,
                    #[inline(always)]
                    |y, out| {
                        plane.with_valid_row(
                            u32::from(rows[y as usize]),
                            #[inline(always)]
                            |row| {
                                let pixels = |[dx, dy]: [f32; 2]| [dx * factor[0], dy * factor[1]];
                                if is_own {
                                    let (texels, _) = row.as_chunks::<$bytes>();
                                    for (displacement, texel) in out.iter_mut().zip(texels) {
                                        *displacement = pixels(stored_motion($format, texel, 0));
                                    }
                                    return;
                                }
                                for (displacement, &x) in out.iter_mut().zip(table) {
                                    let stored = stored_motion($format, row, usize::from(x));
                                    *displacement = pixels(stored);
                                }
                            },
                        );
                    },
                )
            };
        }
        match convention.format {
            MotionFormat::Rg16f => read!(MotionFormat::Rg16f, 4),
            MotionFormat::Rg32f => read!(MotionFormat::Rg32f, 8),
        }
        match convention.camera_motion {
            format::CameraMotion::Included => Ok(()),
            format::CameraMotion::Missing => self.add_camera_motion(columns, out),
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "sizes up to 8192 are exact")]
    fn add_camera_motion(
        &self,
        columns: &mut [Vec<u16>; 2],
        out: &mut Plane<[f32; 2]>,
    ) -> Result<(), DecodeError> {
        let parts = self.depth.zip(self.format.depth).zip(self.cameras);
        let Some(((plane, convention), (older, newer))) = parts else { return Ok(()) };
        let motion = CameraMotion::between(&older, &newer, size(self.image))?;
        self.tables(&plane, columns);
        let [table, rows] = &*columns;
        let cells = self.cells.map(|cells| cells as f32);
        for_each_row(
            self.pool,
            out,
            #[inline(always)]
            |y, out| {
                let v = (y as f32 + 0.5 + self.jitter[1]) / cells[1];
                plane.with_valid_row(
                    u32::from(rows[y as usize]),
                    #[inline(always)]
                    |row| {
                        for (x, displacement) in out.iter_mut().enumerate() {
                            let u = (x as f32 + 0.5 + self.jitter[0]) / cells[0];
                            let stored =
                                stored_depth(convention.format, row, usize::from(table[x]));
                            let z = clip_depth(convention, self.projection, stored);
                            let [dx, dy] = motion.displacement(u, v, z);
                            *displacement = [displacement[0] + dx, displacement[1] + dy];
                        }
                    },
                );
            },
        );
        Ok(())
    }
}

/// Whether each column of the grid takes the sample of its own number: rows are then read straight.
fn is_own_sample(columns: &[u16], plane: &CheckedPlane<'_>) -> bool {
    columns.len() <= plane.valid.width as usize
        && columns.iter().enumerate().all(|(column, sample)| usize::from(*sample) == column)
}
