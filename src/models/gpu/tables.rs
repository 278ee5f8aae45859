//! Data of the cases on a device: samples, norms and look-up tables, uploaded once.

use super::device::{Device, Fault};
use crate::evaluator::{Cell, Course, Table};
use crate::score::GoodnessOfFit;
use crate::text::option::EVALUATOR;
use std::ops::Range;

/// `Job` of shaders/kernel.wgsl: one per case.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Job {
    sample: u32,
    samples: u32,
    norm: u32,
    grade_cell: u32,
    grade_cells: u32,
    mfc_cell: u32,
    mfc_cells: u32,
    m_0: f32,
    phi_f: f32,
    dt: f32,
    period: f32,
    per_period: f32,
    grade_origin: f32,
    grade_per_width: f32,
    mfc_origin: f32,
    mfc_per_width: f32,
}

type Vec4 = [f32; 4];

const UPLOADING: &str = "uploading the trajectories";

/// The texts of the buffers before they are uploaded.
#[derive(Debug, Default)]
struct Content {
    jobs: Vec<Job>,
    samples: Vec<Vec4>,
    /// Three vec4 each.
    norms: Vec<[Vec4; 3]>,
    cells: Vec<Vec4>,
}

/// Cases whose tables are bound together.
#[derive(Debug)]
pub(super) struct Tables {
    pub(super) cases: Range<usize>,
    /// Start of the samples of each.
    pub(super) begins: Vec<u32>,
    /// jobs, samples, norms, cells.
    pub(super) buffers: [wgpu::Buffer; 4],
}

impl Tables {
    /// `samples` of the kernel.
    pub(super) fn samples(&self) -> &wgpu::Buffer {
        &self.buffers[1]
    }

    /// Uploads the tables of all cases, in as few groups as the limits of the device allow.
    pub(super) fn upload(device: &Device, courses: &[Course], gof: &GoodnessOfFit) -> Result<Vec<Tables>, Fault> {
        let mut groups = Vec::new();
        let (mut content, mut from) = (Content::default(), 0);
        for (case, course) in courses.iter().enumerate() {
            let own = Content::of(course, gof);
            if !own.fits(device) {
                let message = format!(
                    "the trajectory of {} samples needs {} bytes in one binding, expected at most {}; split it, or use \
                     {EVALUATOR} lanes",
                    course.samples(),
                    own.largest(),
                    device.limits.binding.min(device.limits.buffer)
                );
                return Err(Fault::new(UPLOADING, message));
            }
            if !content.fits_with(&own, device) {
                groups.push(std::mem::take(&mut content).upload(device, from..case)?);
                from = case;
            }
            content.append(own);
        }
        groups.push(content.upload(device, from..courses.len())?);
        Ok(groups)
    }
}

impl Content {
    fn of(course: &Course, gof: &GoodnessOfFit) -> Content {
        let mut content = Content::default();
        let x_road = |i: usize| course.x_road.get(i).map_or(0.0, |x| *x as f32);
        for (i, dx_l) in course.dx_l_f32().into_iter().enumerate() {
            let [s, v, a] = [0, 1, 2].map(|k| course.per_denominator[k][i] as f32);
            content.samples.extend([
                [course.v_l[i] as f32, dx_l, course.s[i] as f32, course.v_f[i] as f32],
                [course.a_f[i] as f32, x_road(i), course.v_denominator[i] as f32, course.s_start[i] as f32],
                [s, v, a, 0.0],
            ]);
            if let Some(world) = &course.world {
                content.samples.push([world.a_l[i], world.v_l2[i], world.s_l2[i], world.t[i]].map(|x| x as f32));
            }
        }
        for first in 0..course.firsts() {
            let norm = course.norm(gof, first);
            let padded = |x: [f64; 3]| [x[0] as f32, x[1] as f32, x[2] as f32, 0.0];
            content.norms.push([norm.per_count, norm.weight, norm.rms_measured].map(padded));
        }
        let (grade, mfc) = (course.grade.as_ref(), course.mfc.as_ref());
        for (k, node) in grade.iter().flat_map(|table| table.node.iter().enumerate()) {
            let Cell { at, below, above } = grade.expect("it has nodes").curves[0][k];
            content.cells.push([*node, at, below.m, above.m].map(|x| x as f32));
        }
        let mfc_cell = content.cells.len() as u32;
        for (k, node) in mfc.iter().flat_map(|table| table.node.iter().enumerate()) {
            let [dp, ap] = [0, 1].map(|curve| mfc.expect("it has nodes").curves[curve][k]);
            for line in [
                [*node, dp.at, ap.at, 0.0],
                [dp.below.c, dp.below.m, ap.below.c, ap.below.m],
                [dp.above.c, dp.above.m, ap.above.c, ap.above.m],
            ] {
                content.cells.push(line.map(|x| x as f32));
            }
        }
        let cells = |table: Option<&Table>| table.map_or(1, |t| t.node.len() as u32);
        let scale = |table: Option<&Table>| table.map_or((0.0, 0.0), |t| (t.origin as f32, t.per_width as f32));
        let per_period = if course.period > 0.0 { 1.0 / course.period } else { 0.0 };
        content.jobs.push(Job {
            sample: 0,
            samples: course.samples() as u32,
            norm: 0,
            grade_cell: 0,
            grade_cells: cells(grade),
            mfc_cell,
            mfc_cells: cells(mfc),
            m_0: course.m_0 as f32,
            phi_f: course.phi_f as f32,
            dt: course.dt as f32,
            period: course.period as f32,
            per_period: per_period as f32,
            grade_origin: scale(grade).0,
            grade_per_width: scale(grade).1,
            mfc_origin: scale(mfc).0,
            mfc_per_width: scale(mfc).1,
        });
        content
    }

    fn sizes(&self) -> [usize; 4] {
        [
            size_of_val(self.jobs.as_slice()),
            size_of_val(self.samples.as_slice()),
            size_of_val(self.norms.as_slice()),
            size_of_val(self.cells.as_slice()),
        ]
    }

    fn largest(&self) -> u64 {
        self.sizes().into_iter().max().unwrap_or(0) as u64
    }

    fn fits(&self, device: &Device) -> bool {
        device.holds(self.largest())
    }

    fn fits_with(&self, other: &Content, device: &Device) -> bool {
        self.sizes().iter().zip(other.sizes()).all(|(a, b)| device.holds((a + b) as u64))
    }

    fn append(&mut self, other: Content) {
        let (sample, norm, cell) = (self.samples.len() as u32, self.norms.len() as u32, self.cells.len() as u32);
        self.jobs.extend(other.jobs.into_iter().map(|job| Job {
            sample: job.sample + sample,
            norm: job.norm + norm,
            grade_cell: job.grade_cell + cell,
            mfc_cell: job.mfc_cell + cell,
            ..job
        }));
        self.samples.extend(other.samples);
        self.norms.extend(other.norms);
        self.cells.extend(other.cells);
    }

    fn upload(&self, device: &Device, cases: Range<usize>) -> Result<Tables, Fault> {
        let buffer = |label: &str, bytes: &[u8]| {
            // A binding must not be empty.
            let size = bytes.len().max(16) as u64;
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
            let buffer = device.buffer(label, size, usage);
            if !bytes.is_empty() {
                device.queue.write_buffer(&buffer, 0, bytes);
            }
            buffer
        };
        let buffers = device.making(UPLOADING, || {
            [
                buffer("jobs", bytemuck::cast_slice(&self.jobs)),
                buffer("samples", bytemuck::cast_slice(&self.samples)),
                buffer("norms", bytemuck::cast_slice(&self.norms)),
                buffer("cells", bytemuck::cast_slice(&self.cells)),
            ]
        })?;
        let begins = self.jobs.iter().map(|job| job.sample).collect();
        Ok(Tables { cases, begins, buffers })
    }
}
