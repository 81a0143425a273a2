//! Which graphics adapter draws, and the device opened on it.

use std::fmt;
use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::{Error, Result};

/// Which adapter a person wants.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// A real GPU where there is one, else the software driver.
    #[default]
    Auto,
    /// The software driver (lavapipe, WARP), whose pictures are the same on every machine.
    Software,
    /// A real GPU; no fallback.
    Gpu,
    /// The strongest whose name contains these words, whatever the case.
    Named(String),
}

impl FromStr for AdapterChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "auto" => Self::Auto,
            "software" => Self::Software,
            "gpu" => Self::Gpu,
            name => Self::Named(name.to_owned()),
        })
    }
}

impl fmt::Display for AdapterChoice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Software => "software",
            Self::Gpu => "gpu",
            Self::Named(name) => name,
        })
    }
}

impl AdapterChoice {
    /// The number of the adapter that suits best. Of equals the first, so that it depends on nothing but the drivers' own order.
    pub fn best<'a>(&self, infos: impl IntoIterator<Item = &'a wgpu::AdapterInfo>) -> Option<usize> {
        let ranked = infos.into_iter().enumerate().filter_map(|(number, info)| Some((self.rank(info)?, number)));
        ranked.reduce(|best, next| if next.0 > best.0 { next } else { best }).map(|(_, number)| number)
    }

    /// How well an adapter suits the choice; `None` when it does not. Higher is better.
    fn rank(&self, info: &wgpu::AdapterInfo) -> Option<u32> {
        use wgpu::DeviceType::{Cpu, DiscreteGpu, IntegratedGpu, Other, VirtualGpu};
        let power = match info.device_type {
            DiscreteGpu => 4,
            IntegratedGpu => 3,
            VirtualGpu => 2,
            Other => 1,
            Cpu => 0,
        };
        let fits = match self {
            Self::Auto => true,
            Self::Software => info.device_type == Cpu,
            Self::Gpu => info.device_type != Cpu,
            Self::Named(name) => info.name.to_lowercase().contains(&name.to_lowercase()),
        };
        fits.then_some(power)
    }
}

/// The entry to the machine's graphics drivers.
pub fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    // Validation layers are for whoever debugs the drivers; wgpu's own checks stay on.
    descriptor.flags = wgpu::InstanceFlags::empty().with_env();
    wgpu::Instance::new(descriptor)
}

/// An open device and everything that must outlive it.
#[derive(Debug)]
pub struct Gpu {
    /// The drivers' entry, for surfaces.
    pub instance: wgpu::Instance,
    /// The adapter in use.
    pub adapter: wgpu::Adapter,
    /// Its device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, kind and driver.
    pub info: wgpu::AdapterInfo,
    trouble: Arc<Mutex<Trouble>>,
}

/// What went wrong outside error scopes, in the driver's words.
#[derive(Debug, Default)]
struct Trouble {
    /// The first error that nobody has asked for yet.
    error: Option<String>,
    /// Why the device is gone. That stays.
    loss: Option<String>,
}

/// The troubles, even where a thread has panicked over them: they are whole between any two statements.
fn locked(trouble: &Mutex<Trouble>) -> MutexGuard<'_, Trouble> {
    trouble.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Gpu {
    /// Opens the adapter that suits `choice` best.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] when none does, [`Error::Device`] when it cannot be opened.
    pub fn open(choice: &AdapterChoice) -> Result<Self> {
        let instance = instance();
        let found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        let infos: Vec<_> = found.iter().map(wgpu::Adapter::get_info).collect();
        let Some(adapter) = choice.best(&infos).and_then(|best| found.into_iter().nth(best)) else {
            return Err(Error::NoAdapter { wanted: choice.to_string(), found: infos.into_iter().map(|info| info.name).collect() });
        };
        Self::open_adapter(instance, adapter)
    }

    /// Opens a given adapter.
    ///
    /// # Errors
    /// [`Error::Device`] when it refuses.
    pub fn open_adapter(instance: wgpu::Instance, adapter: wgpu::Adapter) -> Result<Self> {
        let info = adapter.get_info();
        let wanted = wgpu::Features::TIMESTAMP_QUERY
            | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS
            | wgpu::Features::POLYGON_MODE_LINE
            | wgpu::Features::INDIRECT_FIRST_INSTANCE;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("sphereboard"),
            required_features: adapter.features() & wanted,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::Device { adapter: info.name.clone(), what: e.to_string() })?;
        let trouble = Arc::<Mutex<Trouble>>::default();
        let (on_error, on_loss) = (trouble.clone(), trouble.clone());
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            locked(&on_error).error.get_or_insert(error.to_string());
        }));
        device.set_device_lost_callback(move |_, message| {
            locked(&on_loss).loss.get_or_insert(format!("the device was lost ({message})"));
        });
        Ok(Self { instance, adapter, device, queue, info, trouble })
    }

    /// Whether the device can time passes itself.
    pub fn has_timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
    }

    /// What went wrong since the last call, if anything; a lost device is an error for ever, and only opening it again helps. Every public
    /// drawing function asks this before it returns.
    ///
    /// # Errors
    /// [`Error::Device`] with the driver's words.
    pub fn check(&self) -> Result<()> {
        // A loss is told when somebody polls.
        let _ = self.device.poll(wgpu::PollType::Poll);
        let mut trouble = locked(&self.trouble);
        let error = trouble.error.take();
        let what = trouble.loss.clone().or(error);
        what.map_or(Ok(()), |what| Err(Error::Device { adapter: self.info.name.clone(), what }))
    }

    /// Runs `make`, which creates things on the device, and gives its result unless memory ran out or the driver refused.
    ///
    /// # Errors
    /// [`Error::Device`] with the driver's words.
    pub fn guarded<T>(&self, make: impl FnOnce() -> T) -> Result<T> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let made = make();
        let refused = pollster::block_on(validation.pop());
        let what = pollster::block_on(memory.pop()).or(refused);
        self.check()?;
        what.map_or(Ok(made), |what| Err(Error::Device { adapter: self.info.name.clone(), what: what.to_string() }))
    }

    /// Waits until everything submitted has been done.
    ///
    /// # Errors
    /// [`Error::Device`] when the device was lost on the way.
    pub fn wait(&self) -> Result<()> {
        let done = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        done.map(|_| ()).map_err(|e| Error::Device { adapter: self.info.name.clone(), what: e.to_string() })
    }
}
