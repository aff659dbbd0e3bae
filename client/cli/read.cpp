// drape read: the states of cloths, as text or into a file.
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/options.h"
#include "client/cli/state_writers.h"

namespace drape::cli {
namespace {

struct ReadOptions {
  SessionFlags target;
  StateFileOptions file;  // its particles are the ones to read
  std::string states;
  bool is_json = false;
};

nlohmann::ordered_json VectorsJson(const VectorView& vectors) {
  // Flat, as lists of vectors are everywhere; in the precision of the backend.
  if (vectors.is_float64()) {
    return std::vector<double>(vectors.doubles().begin(), vectors.doubles().end());
  }
  return std::vector<float>(vectors.floats().begin(), vectors.floats().end());
}

void PrintJson(const States& states, const StateFileOptions& file) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const ClothState& cloth : states) {
    nlohmann::ordered_json entry = {
        {"id", std::to_string(cloth.cloth_id)}, {"step", cloth.step}, {"time_s", cloth.time_s}};
    if (!file.particles.empty()) entry["particles"] = file.particles;
    entry["positions_m"] = VectorsJson(cloth.positions_m);
    entry["velocities_m_per_s"] = VectorsJson(cloth.velocities_m_per_s);
    json.push_back(std::move(entry));
  }
  std::cout << json.dump() << "\n";
}

void PrintText(const States& states, const StateFileOptions& file) {
  for (const ClothState& cloth : states) {
    std::printf("cloth %lu: step %lu, time %.9g s, %zu particles\n", cloth.cloth_id, cloth.step,
                cloth.time_s, cloth.particle_count);
    for (size_t row = 0; row < cloth.particle_count; ++row) {
      std::printf("%6u  %12.6f %12.6f %12.6f\n", file.ParticleOf(row), cloth.positions_m.At(row, 0),
                  cloth.positions_m.At(row, 1), cloth.positions_m.At(row, 2));
    }
  }
}

// A server that does not know `particles` sends all.
void CheckRows(const States& states, const std::vector<uint32_t>& particles) {
  for (const ClothState& cloth : states) {
    if (particles.empty() || cloth.particle_count == particles.size()) continue;
    throw std::runtime_error("the server gives " + std::to_string(cloth.particle_count) +
                             " particles of each cloth instead of " +
                             std::to_string(particles.size()) + ": it is too old for --particles");
  }
}

int Read(const ReadOptions& options) {
  const Client client = options.target.address.Connect();
  const Session session = options.target.Attach(client);
  v1::StateView view;
  view.set_positions(true);
  view.set_velocities(true);
  view.mutable_particles()->Assign(options.file.particles.begin(), options.file.particles.end());
  const std::vector<ClothId>& cloths = options.target.cloths;
  const States states =
      cloths.empty() ? session.ReadStates(view) : session.ReadStates(cloths, view);
  CheckRows(states, options.file.particles);
  if (!options.states.empty()) {
    const auto writer = MakeStateWriter(options.states, options.file);
    writer->Add(states);
    writer->Finish();
  } else if (options.is_json) {
    PrintJson(states, options.file);
  } else {
    PrintText(states, options.file);
  }
  return kDone;
}

}  // namespace

void AddRead(CLI::App& app, Action& action) {
  CLI::App* read = app.add_subcommand("read", "Read the states of cloths");
  auto options = std::make_shared<ReadOptions>();
  options->target.AddTo(*read);
  read->add_option(
          "--particles", options->file.particles,
          "Read only these particles of every cloth, strictly ascending, e.g. 0,31 (default: all)")
      ->delimiter(',')
      ->type_name("INDEX,...");
  read->add_option("--states", options->states,
                   "Write them to a file: " + StateFileExtensions() + " (points)")
      ->check(StateFileValidator())
      ->type_name("FILE");
  read->add_flag("--json", options->is_json, "Print JSON");
  read->callback([options, &action] { action = [options] { return Read(*options); }; });
}

}  // namespace drape::cli
