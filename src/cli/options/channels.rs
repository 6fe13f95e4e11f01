//! The channels of a model that is evaluated without a measurement.

use brdfit::Error;
use brdfit::error::excerpt;
use brdfit::parameters::Settings;

/// The channels of a MERL table.
pub const RGB: [&str; 3] = ["r", "g", "b"];

/// The channels that the settings name; if they name none, r, g and b on a MERL grid and a single channel f elsewhere.
pub fn channels(settings: &Settings, on_grid: bool) -> Result<Vec<String>, Error> {
    let mut named: Vec<String> = Vec::new();
    for (selector, _) in settings {
        if let Some(channel) = selector.channel_if_any()
            && !named.contains(&channel)
        {
            named.push(channel);
        }
    }
    if on_grid {
        if let Some(other) = named.iter().find(|name| !RGB.contains(&name.as_str())) {
            return Err(Error::invalid("--grid merl", "channels r, g and b", excerpt(other)));
        }
        return Ok(RGB.map(str::to_owned).to_vec());
    }
    Ok(if named.is_empty() { vec!["f".to_owned()] } else { named })
}
