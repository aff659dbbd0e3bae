#include "server/gl/device_choice.h"

#include <epoxy/egl.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <filesystem>

namespace drape::gl {

namespace {

// EGL_EXT_device_persistent_id, which libepoxy 1.5 does not know.
constexpr EGLint kDeviceUuid = 0x335C;
using QueryDeviceBinary = EGLBoolean (*)(EGLDeviceEXT, EGLint, EGLint, void*, EGLint*);

constexpr size_t kUuidBytes = 16;
constexpr size_t kLeastUuidDigits = 4;

bool Has(const EglDevice& device, std::string_view extension) {
  return (" " + device.extensions + " ").find(" " + std::string(extension) + " ") !=
         std::string::npos;
}

// Of the device file, such as /dev/dri/card0, as the kernel tells it.
std::string PciAddressOf(const EglDevice& device) {
  if (!Has(device, "EGL_EXT_device_drm")) return "";
  const char* file = eglQueryDeviceStringEXT(device.handle, EGL_DRM_DEVICE_FILE_EXT);
  if (file == nullptr) return "";
  const std::filesystem::path node = std::filesystem::path(file).filename();
  std::error_code error;
  const auto link = std::filesystem::read_symlink("/sys/class/drm" / node / "device", error);
  return error ? "" : link.filename().string();
}

std::string UuidOf(const EglDevice& device) {
  if (!Has(device, "EGL_EXT_device_persistent_id")) return "";
  const auto query =
      reinterpret_cast<QueryDeviceBinary>(eglGetProcAddress("eglQueryDeviceBinaryEXT"));
  std::array<uint8_t, kUuidBytes> bytes{};
  EGLint size = 0;
  if (query == nullptr ||
      !query(device.handle, kDeviceUuid, static_cast<EGLint>(bytes.size()), bytes.data(), &size) ||
      size != static_cast<EGLint>(bytes.size())) {
    return "";
  }
  std::string text = "GPU-";
  for (size_t k = 0; k < bytes.size(); ++k) {
    constexpr char kDigits[] = "0123456789abcdef";
    if (k == 4 || k == 6 || k == 8 || k == 10) text += '-';
    text += kDigits[bytes[k] >> 4];
    text += kDigits[bytes[k] & 15];
  }
  return text;
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char letter) { return std::tolower(letter); });
  return lower;
}

std::string WithoutPrefix(const std::string& text, std::string_view prefix) {
  return text.starts_with(prefix) ? text.substr(prefix.size()) : text;
}

bool IsNumber(std::string_view text) {
  constexpr size_t kMostDigits = 3;  // longer ones are the beginning of a UUID
  return !text.empty() && text.size() <= kMostDigits &&
         text.find_first_not_of("0123456789") == std::string_view::npos;
}

bool IsNamed(const DeviceNames& device, std::string_view choice) {
  if (IsNumber(choice)) return device.index == std::stoi(std::string(choice));
  const std::string wanted = LowerCase(choice);
  const std::string pci = LowerCase(device.pci_address);
  if (!pci.empty() && (wanted == pci || "0000:" + wanted == pci)) return true;
  const std::string digits = WithoutPrefix(wanted, "gpu-");
  return digits.size() >= kLeastUuidDigits &&
         WithoutPrefix(LowerCase(device.uuid), "gpu-").starts_with(digits);
}

}  // namespace

DeviceNames NamesOf(const EglDevice& device) {
  return {.index = device.index,
          .pci_address = PciAddressOf(device),
          .uuid = UuidOf(device),
          .is_software = device.is_software};
}

std::string ToText(const DeviceNames& names) {
  std::string text = std::to_string(names.index);
  if (!names.pci_address.empty()) text += "  " + names.pci_address;
  if (!names.uuid.empty()) text += "  " + names.uuid;
  if (names.is_software) text += "  (software)";
  return text;
}

Result<DeviceNames> FindDevice(std::string_view choice, std::span<const DeviceNames> devices) {
  std::string list;
  std::vector<DeviceNames> found;
  for (const DeviceNames& device : devices) {
    list += (list.empty() ? "" : "; ") + ToText(device);
    if (IsNamed(device, choice)) found.push_back(device);
  }
  const std::string there_is = "; there is: " + (list.empty() ? std::string("none") : list);
  if (found.empty()) {
    return Status(StatusCode::kNotFound, "NO_SUCH_DEVICE",
                  "no device is called \"" + std::string(choice) +
                      "\" (an index, a PCI address or a UUID)" + there_is);
  }
  if (found.size() > 1) {
    return Status(StatusCode::kInvalidArgument, "AMBIGUOUS_DEVICE",
                  "several devices are called \"" + std::string(choice) + "\"" + there_is);
  }
  return found.front();
}

std::vector<DeviceNames> ListDevices() {
  std::vector<DeviceNames> devices;
  for (const EglDevice& device : ListEglDevices()) devices.push_back(NamesOf(device));
  return devices;
}

Result<std::function<bool(const EglDevice&)>> FilterFor(std::string_view choice) {
  if (choice.empty()) return std::function<bool(const EglDevice&)>();
  const std::vector<DeviceNames> devices = ListDevices();
  const Result<DeviceNames> found = FindDevice(choice, devices);
  if (!found.ok()) return found.status();
  const int index = found.value().index;
  return std::function<bool(const EglDevice&)>(
      [index](const EglDevice& device) { return device.index == index; });
}

}  // namespace drape::gl
