// Every flag, limit and default of draped.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/api/limits.h"
#include "server/api/tls_files.h"
#include "server/checkpoints/checkpoint_keeper.h"
#include "server/core/log.h"
#include "server/render/render_thread.h"
#include "server/scheduler/scheduler.h"
#include "server/session/session_limits.h"

namespace drape {

enum class BackendChoice { kAuto, kGl, kCpu, kReference };

struct Config {
  std::string listen = "127.0.0.1:7743";
  std::string port_file;  // empty: none
  BackendChoice backend = BackendChoice::kAuto;
  bool insecure = false;
  api::TlsFiles tls;
  std::string metrics_listen;  // HOST:PORT of the port for monitoring; empty: none
  std::string admin_listen;    // HOST:PORT of this machine or unix:PATH for operators; empty: none
  std::string server_id;       // in names of sessions; empty: a random one with every start
  std::string token_file;      // empty: tenants by certificate, or none (api/authentication.h)
  std::string log_level = "info";
  LogFormat log_format = LogFormat::kText;
  std::string shader_dir;             // empty: the shaders in the executable
  std::string program_cache_dir;      // empty: the user's cache folder, on GPUs
  uint32_t device_timeout_s = 300;    // a device that does not answer is lost; 0: never
  std::string device;                 // of the gl backend (gl/device_choice.h); empty: the first
  bool lists_devices = false;         // instead of serving
  uint32_t threads = 0;               // of the cpu backend; 0 = one per core
  uint32_t builder_threads = 2;       // that build scene models
  uint32_t max_queued_builds = 1024;  // models that wait for them
  uint32_t drain_grace_ms = 10'000;   // to finish accepted work when a signal comes
  uint32_t reap_interval_ms = 1'000;  // between two searches for expired sessions
  uint32_t keepalive_ms = 30'000;     // a vanished peer is noticed after this and the next
  uint32_t keepalive_timeout_ms = 10'000;
  // Of each tenant without a rate of its own [particle-substeps/s]; 0: no limit (rate_quota.h).
  double max_particle_substeps_per_s_per_tenant = 0;
  // Seconds of builder threads per second, likewise (api/build_queue.h).
  double max_builder_s_per_s_per_tenant = 1;
  uint32_t max_connections = 4096;          // more are refused at once (accept_guard.h)
  uint32_t max_connections_per_peer = 256;  // but this machine
  uint32_t max_calls_per_connection = 256;
  uint64_t max_transport_bytes = uint64_t{2} << 30;
  CheckpointOptions checkpoints;
  api::RequestLimits requests;
  SessionLimits sessions;
  SchedulerLimits scheduler;
  render::RenderLimits pictures;
};

// Lowers the default limits of bytes to parts of the memory that the process may have, so that all
// of them together fit: docker/operating.md has the table. Those above 32 GiB keep what they are.
void FitToMemory(Config& config, uint64_t memory_bytes);

// The outcome of parsing the command line: run a server, or end at once.
struct CommandLine {
  Config config;
  std::optional<int> exit_code;  // 0 after --help, --version and --print-config, 2 for a usage
                                 // error; text is printed
};

// Flags, and the file that --config names (config_file.h). A flag on the command line wins.
CommandLine ParseCommandLine(int argc, const char* const* argv);

}  // namespace drape
