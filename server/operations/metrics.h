// The numbers of a server as text for Prometheus.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/core/duration_histogram.h"

namespace drape {

// Since the start, except those marked "now".
struct ServerNumbers {
  std::string version;
  std::string backend;
  std::string server_id;
  bool is_draining = false;  // now
  uint64_t batches = 0;
  uint64_t dispatches = 0;
  uint64_t cloth_steps = 0;
  uint64_t cloth_steps_asleep = 0;
  uint64_t faults = 0;
  uint64_t long_step_pieces = 0;
  uint64_t frames_sent = 0;
  uint64_t frames_encoded = 0;
  uint64_t frames_dropped = 0;
  uint64_t slow_consumers = 0;
  uint64_t runs = 0;  // now
  uint64_t run_steps_dropped = 0;
  DurationHistogram::Counts batch_durations;
  DurationHistogram::Counts request_durations;  // of Step, from its arrival to its end
  uint64_t queued_requests = 0;                 // now
  uint64_t queued_commands = 0;                 // now
  uint64_t queued_builds = 0;                   // now
  uint64_t refused_builds = 0;
  double builder_s = 0;
  uint64_t sessions = 0;          // now
  uint64_t cloths = 0;            // now
  uint64_t particles = 0;         // now
  uint64_t unread_bytes = 0;      // now
  uint64_t remembered_bytes = 0;  // now
  uint64_t saved_bytes = 0;       // now
  uint64_t refused_connections = 0;
  // Now: since the last complete round of checkpoints began; none without checkpoints.
  std::optional<double> checkpoint_age_s;
};

// Prometheus' text format. Pure.
std::string MetricsText(const ServerNumbers& numbers);

}  // namespace drape
