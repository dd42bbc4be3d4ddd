//! `raytree devices`: what can render.

use raytree::{DeviceError, DeviceInfo, list_devices};
use serde_json::{Value, json};

use crate::args::DevicesArgs;
use crate::console::{print, print_json};

pub fn run(args: &DevicesArgs) -> anyhow::Result<()> {
    let devices = list_devices();
    if devices.is_empty() {
        return Err(DeviceError::NoDriver.into());
    }
    if args.json {
        print_json(&as_json(&devices))?;
    } else {
        print(&as_text(&devices))?;
    }
    Ok(())
}

fn as_json(devices: &[DeviceInfo]) -> Value {
    let list: Vec<Value> = devices
        .iter()
        .enumerate()
        .map(|(index, device)| {
            json!({ "index": index, "name": device.name, "driver": device.driver, "type": kind(device) })
        })
        .collect();
    json!({ "devices": list })
}

fn as_text(devices: &[DeviceInfo]) -> String {
    devices
        .iter()
        .enumerate()
        .map(|(index, device)| {
            format!(
                "{index}  {}  {} ({})\n",
                kind(device),
                device.name,
                device.driver
            )
        })
        .collect()
}

fn kind(device: &DeviceInfo) -> &'static str {
    if device.cpu { "cpu" } else { "gpu" }
}
