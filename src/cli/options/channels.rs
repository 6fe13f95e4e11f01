//! The channels of a model that is evaluated without a measurement.

use brdfit::Error;
use brdfit::error::excerpt;
use brdfit::parameters::Settings;

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
        let rgb = ["r", "g", "b"].map(str::to_owned);
        if let Some(other) = named.iter().find(|name| !rgb.contains(name)) {
            return Err(Error::invalid("--grid merl", "channels r, g and b", excerpt(other)));
        }
        return Ok(rgb.to_vec());
    }
    Ok(if named.is_empty() { vec!["f".to_owned()] } else { named })
}
