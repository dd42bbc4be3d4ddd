//! How a window of the picture is cut into batches of 8x8 tiles, and which slot renders which pixel. The shaders' half of
//! this is in `shaders/camera.wgsl`.

/// Pixels on a tile's side.
const TILE: u32 = 8;

/// Lanes of a workgroup: a tile's pixels.
pub(crate) const TILE_PIXELS: u32 = TILE * TILE;

/// The window as tiles, row by row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tiling {
    width: u32,
    height: u32,
    pub(crate) columns: u32,
    pub(crate) tiles: u32,
}

/// Tiles that are worked on at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Batch {
    pub(crate) first_tile: u32,
    pub(crate) tile_count: u32,
    /// Workgroup `g` renders tile `first_tile + g * stride % tile_count`.
    pub(crate) stride: u32,
}

impl Tiling {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        let columns = width.div_ceil(TILE);
        Self {
            width,
            height,
            columns,
            tiles: columns * height.div_ceil(TILE),
        }
    }

    /// Batches of at most `tiles_at_once`, of about equal size.
    pub(crate) fn batches(self, tiles_at_once: u32) -> Vec<Batch> {
        let count = self.tiles.div_ceil(tiles_at_once.max(1)).max(1);
        let size = self.tiles.div_ceil(count);
        (0..count)
            .map(|index| {
                let first_tile = index * size;
                let tile_count = size.min(self.tiles - first_tile.min(self.tiles));
                Batch {
                    first_tile,
                    tile_count,
                    stride: spreading_stride(tile_count),
                }
            })
            .filter(|batch| batch.tile_count > 0)
            .collect()
    }

    /// The pixel that a slot renders, as an index into the window; `None` for slots beyond its edges.
    pub(crate) fn pixel_of_slot(self, batch: Batch, slot: u32) -> Option<usize> {
        let (workgroup, lane) = (slot / TILE_PIXELS, slot % TILE_PIXELS);
        // Fits 32 bits: spreading_stride sees to it, as the shaders need it.
        let tile = batch.first_tile + workgroup * batch.stride % batch.tile_count;
        let (block, within) = (lane / 8, lane % 8);
        let x = TILE * (tile % self.columns) + (block % 2) * 4 + within % 4;
        let y = TILE * (tile / self.columns) + (block / 2) * 2 + within / 4;
        (x < self.width && y < self.height).then(|| y as usize * self.width as usize + x as usize)
    }
}

/// A stride coprime to `count` and near its golden section, so that consecutive workgroups render tiles that lie apart.
/// Small enough that `count * stride` fits the shader's 32 bits.
pub(crate) fn spreading_stride(count: u32) -> u32 {
    if count < 3 {
        return 1;
    }
    let golden = (f64::from(count) * 0.618_033_988_75) as u32;
    let largest = (u32::MAX / count).max(1);
    (1..=golden.min(largest))
        .rev()
        .find(|&stride| greatest_common_divisor(stride, count) == 1)
        .unwrap_or(1)
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_one_slot() {
        for (width, height, at_once) in [
            (1, 1, 1),
            (8, 8, 10),
            (13, 7, 1),
            (640, 480, 100),
            (65, 130, 7),
            (97, 31, 1000),
        ] {
            let tiling = Tiling::new(width, height);
            let mut slots = vec![0; (width * height) as usize];
            for batch in tiling.batches(at_once) {
                assert!(batch.tile_count <= at_once);
                for slot in 0..batch.tile_count * TILE_PIXELS {
                    if let Some(pixel) = tiling.pixel_of_slot(batch, slot) {
                        slots[pixel] += 1;
                    }
                }
            }
            assert!(slots.iter().all(|&count| count == 1), "{width}x{height}");
        }
    }
}
