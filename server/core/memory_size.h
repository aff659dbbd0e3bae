// How much memory the process may have.
#pragma once

#include <cstdint>
#include <string>

namespace drape {

// The least of what the machine has, what its control groups allow (both versions) and what its
// limits of data and addresses allow [bytes]; > 0.
uint64_t MemoryOfProcess_bytes();

// The least limit of memory along the path of control groups that `membership` names, a text as
// /proc/self/cgroup, under `root`, a folder as /sys/fs/cgroup [bytes]. UINT64_MAX: none.
uint64_t ControlGroupMemory_bytes(const std::string& membership, const std::string& root);

}  // namespace drape
