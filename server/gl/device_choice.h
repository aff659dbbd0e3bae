// Which of several GPUs: by index, PCI address or UUID.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/core/status.h"
#include "server/gl/context.h"

namespace drape::gl {

// The names of an EGL device.
struct DeviceNames {
  int index = 0;            // in the driver's list
  std::string pci_address;  // "0000:65:00.0"; empty: not told
  std::string
      uuid;  // "GPU-" and 16 bytes as nvidia-smi writes them, in lower case; empty: not told
  bool is_software = false;
};

DeviceNames NamesOf(const EglDevice& device);

// A line for people: "0  0000:65:00.0  GPU-…".
std::string ToText(const DeviceNames& names);

// The device that `choice` names: an index, a PCI address with or without its domain, or a UUID or
// the first digits of one, at least 4, with or without "GPU-". NOT_FOUND (NO_SUCH_DEVICE) lists
// what there is; INVALID_ARGUMENT (AMBIGUOUS_DEVICE) if several have that name.
Result<DeviceNames> FindDevice(std::string_view choice, std::span<const DeviceNames> devices);

// For ContextOptions::device_filter: the device that `choice` names, of those of this machine; any
// if it is empty. Errors as FindDevice.
Result<std::function<bool(const EglDevice&)>> FilterFor(std::string_view choice);

// All devices of this machine, hardware first.
std::vector<DeviceNames> ListDevices();

}  // namespace drape::gl
