//! What a pass needs of a crowd on the device: the lists of trees and the arguments of the calls that draw them, filled here or by
//! `compute` there.

use std::ops::Range;

use super::compute::{Asking, Culler, Places};
use super::cull::{Candidates, Lists};
use super::parts;
use crate::Result;
use crate::gpu::layout::{CullCall, CullLook};
use crate::gpu::{Gpu, KeptBuffer};
use crate::render::tree::Tree;

/// What is sent anew when what is seen changes.
#[derive(Debug)]
pub struct Device {
    /// Numbers of trees, list after list.
    pub lists: KeptBuffer,
    /// A [`CullCall`] for each part of each species.
    pub calls: KeptBuffer,
    /// Where the device asks, what.
    pub asking: Option<Asking>,
}

impl Device {
    /// Of nothing.
    pub fn new(gpu: &Gpu) -> Self {
        use wgpu::BufferUsages as Usages;
        Self {
            lists: KeptBuffer::new(gpu, "crowd.lists", Usages::VERTEX | Usages::STORAGE | Usages::COPY_SRC),
            calls: KeptBuffer::new(gpu, "crowd.calls", Usages::INDIRECT | Usages::STORAGE),
            asking: None,
        }
    }

    /// Sends the lists and the arguments of every draw. Gives how many bytes that were.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when memory runs out.
    pub fn fill(&mut self, gpu: &Gpu, species: &[Tree], lists: &Lists) -> Result<u64> {
        self.asking = None;
        let calls = calls(species, &lists.lists);
        self.lists.fill(gpu, bytemuck::cast_slice(&lists.entries))?;
        self.calls.fill(gpu, bytemuck::cast_slice(&calls))?;
        Ok((size_of_val(&lists.entries[..]) + size_of_val(&calls[..])) as u64)
    }

    /// Sends who may be in the lists, so that the device finds out who is. Gives how many bytes that were.
    ///
    /// # Errors
    /// The same, and [`Error::ShaderRoom`](crate::Error::ShaderRoom) for more candidates than the adapter's shaders can be given.
    pub fn ask(
        &mut self,
        gpu: &Gpu,
        (culler, places): (&Culler, &Places),
        species: &[Tree],
        (look, candidates): (CullLook, &Candidates),
    ) -> Result<u64> {
        let none = vec![0..0; candidates.rooms.len()];
        let calls = calls(species, &none);
        self.calls.fill(gpu, bytemuck::cast_slice(&calls))?;
        let asking = self.asking.get_or_insert_with(|| Asking::new(gpu));
        let sent = asking.fill(gpu, (culler, places), (look, candidates), &mut self.lists, (&self.calls, calls.len()))?;
        Ok(sent + size_of_val(&calls[..]) as u64)
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.lists.get().size() + self.calls.get().size() + self.asking.as_ref().map_or(0, Asking::bytes)
    }
}

/// The arguments of every draw: part by part of each species.
fn calls(species: &[Tree], lists: &[Range<u32>]) -> Vec<CullCall> {
    let firsts = species.iter().scan(0, |sum, tree| Some(std::mem::replace(sum, *sum + tree.groups().len())));
    let of_tree = |(tree, first): (&Tree, usize)| {
        let call = |list: usize, corners| CullCall {
            corners,
            trees: lists.get(list).map_or(0, |list| list.len() as u32),
            list: list as u32,
            ..bytemuck::Zeroable::zeroed()
        };
        parts(tree).map(|part| call(first + part.group, part.count)).collect::<Vec<_>>()
    };
    species.iter().zip(firsts).flat_map(of_tree).collect()
}
