//! Truelsen's batches (§5.3, fig. 32), for comparison: all corners of all trees lie in vertex buffers once, and in every frame one index
//! buffer for each part, and so for each texture, is written anew with the trees that are seen.

use std::ops::Range;

use super::cells::Cells;
use super::parts;
use crate::gpu::{Gpu, KeptBuffer, layout, read_buffer, upload_buffer};
use crate::render::drawer::PassKind;
use crate::render::part::DevicePart;
use crate::render::tree::Tree;
use crate::{Error, Result};

/// Most bytes of all corners: whole trees by the thousand are not what batches are for.
const MOST_BYTES: u64 = 1 << 30;

/// Corners of one part of every tree of a species.
#[derive(Debug)]
struct Corners {
    /// [`layout::Vertex`] each.
    vertices: wgpu::Buffer,
    /// Which tree each belongs to.
    trees: wgpu::Buffer,
    /// Of one tree, and the corners of its triangles.
    count: u32,
    triangles: Vec<u32>,
    /// Written anew for the picture and for the sun's map, with how many are in them.
    indices: [(KeptBuffer, u32); 2],
}

/// All batches of a crowd.
#[derive(Debug)]
pub struct Batches {
    /// By species and part.
    corners: Vec<Vec<Corners>>,
    /// The number of each tree among those of its species.
    ordinals: Vec<u32>,
}

impl Batches {
    /// Puts the corners of all trees onto the device.
    ///
    /// # Errors
    /// [`Error::Device`] when they do not fit, or would take more than a gigabyte.
    pub fn new(gpu: &Gpu, species: &[Tree], cells: &Cells, trees: usize) -> Result<Self> {
        let mut numbers: Vec<Vec<u32>> = species.iter().map(|_| vec![]).collect();
        let mut ordinals = vec![0; trees];
        for run in &cells.runs {
            for tree in run.trees.clone() {
                let of_species = &mut numbers[usize::from(run.species)];
                ordinals[tree as usize] = of_species.len() as u32;
                of_species.push(tree);
            }
        }
        let one = |part: &DevicePart| part.vertices.size() + part.vertices.size() / size_of::<layout::Vertex>() as u64 * 4;
        let each = species.iter().zip(&numbers).map(|(tree, of)| of.len() as u64 * parts(tree).map(one).sum::<u64>());
        let bytes: u64 = each.sum();
        if bytes > MOST_BYTES {
            let what =
                format!("batches of whole trees would take {} MB; --batch vbo is for cards, or for fewer trees", bytes >> 20);
            return Err(Error::Device { adapter: gpu.info.name.clone(), what });
        }
        let corners = species.iter().zip(&numbers);
        let corners = corners.map(|(tree, of)| parts(tree).map(|part| Corners::new(gpu, part, of)).collect::<Result<Vec<_>>>());
        Ok(Self { corners: corners.collect::<Result<_>>()?, ordinals })
    }

    /// Writes the index buffers of a pass anew; gives how many bytes that were.
    ///
    /// # Errors
    /// [`Error::Device`] when memory runs out.
    pub fn fill(&mut self, gpu: &Gpu, kind: PassKind, species: &[Tree], (entries, lists): (&[u32], &[Range<u32>])) -> Result<u64> {
        let (mut first, mut sent) = (0, 0);
        for (tree, of_species) in species.iter().zip(&mut self.corners) {
            for (part, corners) in parts(tree).zip(of_species) {
                let list = lists[first + part.group].clone();
                let seen = &entries[list.start as usize..list.end as usize];
                let of_tree = |tree: &u32| {
                    let base = self.ordinals[*tree as usize] * corners.count;
                    corners.triangles.iter().map(move |corner| base + corner)
                };
                let indices: Vec<u32> = seen.iter().flat_map(of_tree).collect();
                let (buffer, count) = &mut corners.indices[usize::from(kind == PassKind::Shadow)];
                buffer.fill(gpu, bytemuck::cast_slice(&indices))?;
                *count = indices.len() as u32;
                sent += size_of_val(&indices[..]) as u64;
            }
            first += tree.groups().len();
        }
        Ok(sent)
    }

    /// Draws a part of all trees of a species that are seen.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, kind: PassKind, species: usize, number: usize) {
        let corners = &self.corners[species][number];
        let (buffer, count) = &corners.indices[usize::from(kind == PassKind::Shadow)];
        pass.set_vertex_buffer(0, corners.vertices.slice(..));
        pass.set_vertex_buffer(1, corners.trees.slice(..));
        pass.set_index_buffer(buffer.get().slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..*count, 0, 0..1);
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let of = |corners: &Corners| {
            let indices: u64 = corners.indices.iter().map(|(buffer, _)| buffer.get().size()).sum();
            corners.vertices.size() + corners.trees.size() + indices
        };
        self.corners.iter().flatten().map(of).sum()
    }
}

impl Corners {
    fn new(gpu: &Gpu, part: &DevicePart, trees: &[u32]) -> Result<Self> {
        let count = (part.vertices.size() / size_of::<layout::Vertex>() as u64) as u32;
        let one = read_buffer(gpu, &part.vertices)?;
        let triangles: Vec<u32> = bytemuck::pod_collect_to_vec(&read_buffer(gpu, &part.indices)?);
        let numbers: Vec<u32> = trees.iter().flat_map(|tree| std::iter::repeat_n(*tree, count as usize)).collect();
        let (vertices, trees) = gpu.guarded(|| {
            let usage = wgpu::BufferUsages::VERTEX;
            let vertices = upload_buffer(gpu, "batch.vertices", &one.repeat(trees.len()), usage);
            (vertices, upload_buffer(gpu, "batch.trees", bytemuck::cast_slice(&numbers), usage))
        })?;
        let indices = [(); 2].map(|()| (KeptBuffer::new(gpu, "batch.indices", wgpu::BufferUsages::INDEX), 0));
        Ok(Self { vertices, trees, count, triangles, indices })
    }
}
