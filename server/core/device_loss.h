// The device is lost, with all that is on it.
#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace drape {

// Ends the process: only a new one can use the device again. First what OnDeviceLoss gave is called
// on this thread; if nothing was given, or it returns, the process aborts. A second caller waits
// for that. Any thread.
[[noreturn]] void LoseDevice(const std::string& reason);

// Replaces what LoseDevice calls; nothing: it aborts. Any thread.
void OnDeviceLoss(std::function<void(const std::string& reason)> handler);

// How long a device may take to answer before it counts as lost; 0, as at the start: for ever. Any
// thread.
void SetDevicePatience(std::chrono::seconds patience);
std::chrono::seconds DevicePatience();

}  // namespace drape
