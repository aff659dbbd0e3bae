// The GL device that the backend "gl" would run on.
#include <cstdio>

#include "server/gl/context.h"
#include "tests/bench/subcommands.h"

namespace drape::bench {

int ShowDevice(bool needs_hardware) {
  constexpr int kSoftware = 3;
  constexpr int kNone = 4;
  for (const gl::EglDevice& device : gl::ListEglDevices()) {
    std::printf("EGL device %d%s: %s\n", device.index, device.is_software ? " (software)" : "",
                device.extensions.c_str());
  }
  const auto context = gl::Context::Create({});
  if (!context.ok()) {
    std::printf("no OpenGL 4.5 compute: %s\n", context.status().ToString().c_str());
    return kNone;
  }
  const gl::Context& made = **context;
  const gl::DeviceLimits& limits = made.limits();
  std::printf("renderer: %s\nversion: %s\n", made.renderer().c_str(), made.version().c_str());
  std::printf(
      "limits: shared memory %lld bytes, %u invocations per work group, %u storage blocks, "
      "largest %lld bytes\n",
      static_cast<long long>(limits.shared_memory_bytes), limits.work_group_invocations,
      limits.storage_blocks, static_cast<long long>(limits.storage_block_bytes));
  std::printf("invocations per subgroup with shuffles: %u (0: no shuffles)\n", limits.shuffle_size);
  std::printf("kind: %s\n", made.is_software() ? "software" : "hardware");
  return made.is_software() && needs_hardware ? kSoftware : 0;
}

}  // namespace drape::bench
