#include "server/operations/metrics.h"

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <utility>
#include <vector>

namespace drape {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

MetricFamily Family(const char* name, const char* help, MetricType type, ClientMetric metric) {
  MetricFamily family;
  family.name = name;
  family.help = help;
  family.type = type;
  family.metric.push_back(std::move(metric));
  return family;
}

MetricFamily Count(const char* name, const char* help, double value) {
  ClientMetric metric;
  metric.counter.value = value;
  return Family(name, help, MetricType::Counter, std::move(metric));
}

MetricFamily Count(const char* name, const char* help, uint64_t value) {
  return Count(name, help, static_cast<double>(value));
}

MetricFamily Now(const char* name, const char* help, double value) {
  ClientMetric metric;
  metric.gauge.value = value;
  return Family(name, help, MetricType::Gauge, std::move(metric));
}

MetricFamily Now(const char* name, const char* help, uint64_t value) {
  return Now(name, help, static_cast<double>(value));
}

MetricFamily Durations(const char* name, const char* help,
                       const DurationHistogram::Counts& counts) {
  ClientMetric metric;
  uint64_t total = 0;
  for (size_t k = 0; k < DurationHistogram::kBounds_us.size(); ++k) {
    total += counts.buckets[k];
    metric.histogram.bucket.push_back(
        {total, static_cast<double>(DurationHistogram::kBounds_us[k]) / 1e6});
  }
  metric.histogram.sample_count = total + counts.buckets.back();
  metric.histogram.sample_sum = static_cast<double>(counts.sum_us) / 1e6;
  return Family(name, help, MetricType::Histogram, std::move(metric));
}

MetricFamily Info(const ServerNumbers& numbers) {
  ClientMetric metric;
  metric.label = {
      {"version", numbers.version}, {"backend", numbers.backend}, {"server_id", numbers.server_id}};
  metric.gauge.value = 1;
  return Family("drape_server_info", "The server; always 1.", MetricType::Gauge, std::move(metric));
}

}  // namespace

std::string MetricsText(const ServerNumbers& n) {
  std::vector<MetricFamily> families = {
      Info(n),
      Now("drape_draining", "1 while the server shuts down.", uint64_t{n.is_draining}),
      Count("drape_batches_total", "Calls of the backend, pieces of long steps included.",
            n.batches),
      Count("drape_dispatches_total", "Dispatches of the device.", n.dispatches),
      Count("drape_cloth_steps_total", "Completed steps of cloths.", n.cloth_steps),
      Count("drape_cloth_steps_asleep_total", "Of these, complete without being computed.",
            n.cloth_steps_asleep),
      Count("drape_faults_total", "Cloths that blew up.", n.faults),
      Count("drape_long_step_pieces_total", "Pieces of steps longer than a batch may take.",
            n.long_step_pieces),
      Count("drape_frames_sent_total", "Frames of states sent to StreamStates.", n.frames_sent),
      Count("drape_frames_encoded_total", "Frames encoded: viewers of the same share them.",
            n.frames_encoded),
      Count("drape_frames_dropped_total", "Frames that a later one replaced for lack of credit.",
            n.frames_dropped),
      Count("drape_slow_consumers_total", "Streams of every frame that ended because nobody read.",
            n.slow_consumers),
      Now("drape_runs", "Run calls: cloths that the server steps by itself.", n.runs),
      Count("drape_run_steps_dropped_total", "Steps of runs that were too late to be made.",
            n.run_steps_dropped),
      Durations("drape_batch_duration_seconds", "Duration of batches and pieces.",
                n.batch_durations),
      Durations("drape_step_request_duration_seconds",
                "From the arrival of a step request to its end.", n.request_durations),
      Now("drape_queued_requests", "Step requests that have not ended.", n.queued_requests),
      Now("drape_queued_commands", "Commands before the device.", n.queued_commands),
      Now("drape_queued_builds", "Models that wait for a builder.", n.queued_builds),
      Count("drape_builder_seconds_total", "Time of the builder threads.", n.builder_s),
      Count("drape_refused_builds_total", "Builds of tenants that had had their share.",
            n.refused_builds),
      Now("drape_sessions", "Open sessions.", n.sessions),
      Now("drape_cloths", "Cloths of all sessions.", n.cloths),
      Now("drape_particles", "Particles of all cloths.", n.particles),
      Now("drape_unread_bytes", "Requests under way and answers not read.", n.unread_bytes),
      Now("drape_remembered_bytes", "Answers kept for repeated request ids.", n.remembered_bytes),
      Now("drape_saved_bytes", "States kept by name.", n.saved_bytes),
      Count("drape_refused_connections_total", "Connections closed at once.",
            n.refused_connections),
  };
  if (n.checkpoint_age_s) {
    families.push_back(
        Now("drape_checkpoint_age_seconds",
            "Since the last complete round of checkpoints began: what a crash loses.",
            *n.checkpoint_age_s));
  }
  return prometheus::TextSerializer().Serialize(families);
}

}  // namespace drape
