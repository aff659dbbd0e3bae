#include "client/cli/run_scene.h"

#include <algorithm>

namespace drape::cli {
namespace {

v1::StateView FullView() {
  v1::StateView view;
  view.set_positions(true);
  view.set_velocities(true);
  return view;
}

// After `steps` steps since the last sample.
void TakeSample(const Session& session, uint64_t steps, const SampleTime& sample, RunSinks& sinks) {
  const bool has_recorder = std::any_of(sinks.writers.begin(), sinks.writers.end(),
                                        [](const auto& writer) { return writer->takes_samples(); });
  if (!has_recorder && !sinks.comparison) return;
  const States states = session.ReadStates(FullView());
  if (sinks.comparison) sinks.comparison->Advance(steps, states, sinks.should_stop);
  for (const auto& writer : sinks.writers) {
    if (writer->takes_samples()) writer->Add(states, sample);
  }
}

void AddLastState(const Session& session, RunSinks& sinks) {
  for (const auto& writer : sinks.writers) {
    if (!writer->takes_samples()) writer->Add(session.ReadStates(FullView()));
  }
}

// Best effort: the error that ended the run counts.
void KeepSamples(const RunReport& report, RunSinks& sinks) {
  if (report.steps() == 0) return;
  for (const auto& writer : sinks.writers) {
    try {
      if (writer->takes_samples()) writer->Finish();
    } catch (const Error&) {
    }
  }
  try {
    if (sinks.on_failure) sinks.on_failure(report);
  } catch (const Error&) {
  }
}

}  // namespace

std::vector<Topology> SceneTopologies(const v1::Scene& scene) {
  std::vector<Topology> topologies;
  for (const v1::SceneCloth& cloth : scene.cloths()) {
    topologies.insert(topologies.end(), cloth.has_count() ? cloth.count() : 1,
                      TopologyOf(cloth.spec()));
  }
  return topologies;
}

RunReport RunScene(const Client& client, const v1::Scene& scene, uint64_t every, RunSinks& sinks) {
  const v1::ServerInfo server = client.GetServerInfo();
  Session session = client.CreateSession();
  ScenePlayer player(session, scene, server.limits());
  RunReport report(server, player);
  if (sinks.pictures) sinks.pictures->Begin(session);
  try {
    while (player.step() < player.step_count()) {
      const AdvanceResult result =
          player.Advance(every, /*has_reports=*/true, sinks.should_stop,
                         sinks.has_impulses && server.has_impulses(), sinks.has_contacts);
      const uint64_t steps = player.step() - report.steps();
      const double time_s = static_cast<double>(player.step()) * scene.time_step_s();
      TakeSample(session, steps, {player.step(), time_s}, sinks);
      report.Add(steps, result);
      if (sinks.pictures) sinks.pictures->AddSample(session, player.step());
      if (sinks.on_step) sinks.on_step(player.step());
      if (sinks.should_stop && sinks.should_stop()) break;
    }
    AddLastState(session, sinks);
    if (sinks.pictures) sinks.pictures->Finish(session);
  } catch (const Error&) {
    KeepSamples(report, sinks);
    throw;
  }
  for (const auto& writer : sinks.writers) writer->Finish();
  return report;
}

}  // namespace drape::cli
