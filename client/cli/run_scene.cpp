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

void TakeSample(const Session& session, uint64_t steps, RunSinks& sinks) {
  const bool has_recorder = std::any_of(sinks.writers.begin(), sinks.writers.end(),
                                        [](const auto& writer) { return writer->takes_samples(); });
  if (!has_recorder && !sinks.comparison) return;
  const States states = session.ReadStates({}, FullView());
  for (const auto& writer : sinks.writers) {
    if (writer->takes_samples()) writer->Add(states);
  }
  if (sinks.comparison) sinks.comparison->Advance(steps, states);
}

void FinishWriters(const Session& session, RunSinks& sinks) {
  for (const auto& writer : sinks.writers) {
    if (!writer->takes_samples()) writer->Add(session.ReadStates());
    writer->Finish();
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
  while (player.step() < player.step_count()) {
    const uint64_t steps = std::min(every, player.step_count() - player.step());
    report.Add(steps, player.Advance(steps, /*has_reports=*/true));
    TakeSample(session, steps, sinks);
    if (sinks.on_step) sinks.on_step(player.step());
    if (sinks.should_stop && sinks.should_stop()) break;
  }
  FinishWriters(session, sinks);
  return report;
}

}  // namespace drape::cli
