mod help;
mod hostile;
#[cfg(unix)]
mod interrupt;
mod lists;
mod numbers;
mod pictures;
mod readers;
mod reproducible;
mod robustness;
mod sets;
mod settings;
mod undistort;
