// drape read: the states of cloths, as text or into a file.
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/options.h"
#include "client/cli/state_writers.h"

namespace drape::cli {
namespace {

struct ReadOptions {
  SessionFlags target;
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

void PrintJson(const States& states) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const ClothState& cloth : states) {
    json.push_back({{"id", std::to_string(cloth.cloth_id)},
                    {"step", cloth.step},
                    {"time_s", cloth.time_s},
                    {"positions_m", VectorsJson(cloth.positions_m)},
                    {"velocities_m_per_s", VectorsJson(cloth.velocities_m_per_s)}});
  }
  std::cout << json.dump() << "\n";
}

void PrintText(const States& states) {
  for (const ClothState& cloth : states) {
    std::printf("cloth %lu: step %lu, time %.9g s, %zu particles\n", cloth.cloth_id, cloth.step,
                cloth.time_s, cloth.particle_count);
    for (size_t row = 0; row < cloth.particle_count; ++row) {
      std::printf("%6zu  %12.6f %12.6f %12.6f\n", row, cloth.positions_m.At(row, 0),
                  cloth.positions_m.At(row, 1), cloth.positions_m.At(row, 2));
    }
  }
}

int Read(const ReadOptions& options) {
  const Client client = options.target.Connect();
  const Session session = options.target.Attach(client);
  v1::StateView view;
  view.set_positions(true);
  view.set_velocities(true);
  const States states = session.ReadStates(options.target.cloths, view);
  if (!options.states.empty()) {
    const auto writer = MakeStateWriter(options.states, {});
    writer->Add(states);
    writer->Finish();
  } else if (options.is_json) {
    PrintJson(states);
  } else {
    PrintText(states);
  }
  return kDone;
}

}  // namespace

void AddRead(CLI::App& app, Action& action) {
  CLI::App* read = app.add_subcommand("read", "Read the states of cloths");
  auto options = std::make_shared<ReadOptions>();
  options->target.AddTo(*read);
  read->add_option("--states", options->states,
                   "Write them to a file: " + StateFileExtensions() + " (points)")
      ->check(StateFileValidator())
      ->type_name("FILE");
  read->add_flag("--json", options->is_json, "Print JSON");
  read->callback([options, &action] { action = [options] { return Read(*options); }; });
}

}  // namespace drape::cli
