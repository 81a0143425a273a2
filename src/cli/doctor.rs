//! `sphereboard doctor`: can this machine draw, and with what?

use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Command};
use serde_json::json;

use crate::gpu::{AdapterChoice, Found, survey};

use super::{Outcome, look, say};

/// What to do where no adapter is found.
const REMEDY: &str = "\
No graphics adapter was found. `model` and `segment` work without one; `render` and `view` need one.
  Debian, Ubuntu:  sudo apt-get install -y --no-install-recommends mesa-vulkan-drivers libvulkan1   (software driver; 16 MB)
  Fedora:          sudo dnf install mesa-vulkan-drivers vulkan-loader
  Arch:            sudo pacman -S vulkan-swrast vulkan-icd-loader
  A real GPU needs its maker's Vulkan driver; in a container, also access to the device (for example --gpus all, NVIDIA_DRIVER_CAPABILITIES=all).";

/// The command's arguments.
pub fn command() -> Command {
    let command = Command::new("doctor")
        .about("List the graphics adapters, say which one draws and why, and what to install where there is none")
        .arg(Arg::new("json").long("json").action(ArgAction::SetTrue).help("Print it as JSON"));
    look::add_adapter(command)
}

/// Runs it. Exit code 1 when nothing can draw.
pub fn run(matches: &ArgMatches) -> Outcome {
    let choice = look::adapter(matches);
    let (found, used) = survey(&choice);
    let text = if matches.get_flag("json") { as_json(&found, used) } else { as_text(&found, used, &choice) };
    let said = say::out(&text);
    Ok(if said && used.is_some() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn as_json(found: &[Found], used: Option<usize>) -> String {
    let row = |f: &Found| {
        json!({
            "name": f.info.name, "kind": kind(f), "backend": f.info.backend.to_string(), "driver": f.info.driver,
            "driver_info": f.info.driver_info, "max_side_px": f.max_side_px, "max_storage_bytes": f.max_storage_bytes,
            "timestamps": f.timestamps, "wireframe": f.lines,
        })
    };
    format!("{:#}", json!({ "adapters": found.iter().map(row).collect::<Vec<_>>(), "used": used }))
}

fn as_text(found: &[Found], used: Option<usize>, choice: &AdapterChoice) -> String {
    let mut lines: Vec<String> = found.iter().enumerate().flat_map(|(number, f)| lines_of(f, used == Some(number))).collect();
    lines.push(match (used, found.is_empty()) {
        (_, true) => REMEDY.to_owned(),
        (None, _) => format!(
            "--adapter {choice} fits none of these; give auto, software, gpu or a part of a name above. A GPU that is missing here needs its \
             maker's Vulkan driver."
        ),
        (Some(number), _) => format!("--adapter {choice} draws with {}, {}.", found[number].info.name, reason(choice, found)),
    });
    lines.join("\n")
}

fn lines_of(f: &Found, used: bool) -> [String; 3] {
    let info = &f.info;
    let yes = |there: bool| if there { "yes" } else { "no" };
    [
        format!("{} {} ({}, {})", if used { "▶" } else { " " }, info.name, kind(f), info.backend),
        format!("    driver {} {}", info.driver, info.driver_info),
        format!(
            "    pictures up to {} px a side; shader buffers up to {} MiB; times passes itself: {}; wireframe: {}",
            f.max_side_px,
            f.max_storage_bytes >> 20,
            yes(f.timestamps),
            yes(f.lines)
        ),
    ]
}

fn reason(choice: &AdapterChoice, found: &[Found]) -> &'static str {
    let real = found.iter().any(|f| f.info.device_type != wgpu::DeviceType::Cpu);
    match choice {
        AdapterChoice::Auto if real => "the strongest GPU there is",
        AdapterChoice::Auto => "the software driver, since there is no GPU",
        AdapterChoice::Software => "the software driver, as told",
        AdapterChoice::Gpu => "the strongest GPU, as told",
        AdapterChoice::Named(_) => "whose name fits",
    }
}

fn kind(f: &Found) -> &'static str {
    match f.info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete GPU",
        wgpu::DeviceType::IntegratedGpu => "integrated GPU",
        wgpu::DeviceType::VirtualGpu => "virtual GPU",
        wgpu::DeviceType::Cpu => "software",
        wgpu::DeviceType::Other => "of unknown kind",
    }
}
