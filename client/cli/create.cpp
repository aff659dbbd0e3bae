// drape create: the cloths of a scene file, in a session that stays.
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/cli/commands.h"
#include "client/cli/options.h"
#include "drape/scene_file.h"
#include "drape/scene_player.h"

namespace drape::cli {
namespace {

struct CreateOptions {
  std::string scene;
  ServerAddress address;
  std::string session;
  std::optional<double> ttl_s;
  std::vector<std::string> sets;
  bool is_json = false;
};

Session OpenSession(const Client& client, const CreateOptions& options) {
  if (!options.session.empty()) return client.AttachSession(options.session);
  SessionOptions session;
  session.ttl_s = options.ttl_s;
  session.display_name = "drape create";
  session.renews_lease = false;
  return client.CreateSession(session);
}

int Create(const CreateOptions& options) {
  const v1::Scene scene = LoadScene(options.scene, options.sets);
  const Client client = options.address.Connect();
  Session session = OpenSession(client, options);
  const ScenePlayer player(session, scene, client.GetServerInfo().limits());
  session.Detach();
  if (!options.is_json) {
    std::cout << "session " << session.name() << "\n";
    for (const PlayedCloth& cloth : player.cloths()) {
      std::cout << "cloth " << cloth.id << ": " << cloth.shape.particles() << " particles, "
                << cloth.shape.distance_constraints() << " constraints, " << cloth.shape.colours()
                << " colours, plan " << cloth.shape.plan() << "\n";
    }
    return kDone;
  }
  nlohmann::ordered_json json = {{"session", session.name()},
                                 {"cloths", nlohmann::ordered_json::array()}};
  for (const PlayedCloth& cloth : player.cloths()) {
    json["cloths"].push_back({{"id", std::to_string(cloth.id)},
                              {"particles", cloth.shape.particles()},
                              {"constraints", cloth.shape.distance_constraints()},
                              {"colours", cloth.shape.colours()},
                              {"plan", cloth.shape.plan()}});
  }
  std::cout << json.dump(1) << "\n";
  return kDone;
}

}  // namespace

void AddCreate(CLI::App& app, Action& action) {
  CLI::App* create = app.add_subcommand(
      "create", "Create the cloths of a scene file; they stay as long as their session");
  auto options = std::make_shared<CreateOptions>();
  create->add_option("scene", options->scene, "The scene file")
      ->type_name("SCENE.json")
      ->required();
  options->address.AddTo(*create)->required();
  auto* session = create->add_option("--session", options->session,
                                     "Put them into this session (default: a new one)");
  session->type_name("NAME");
  create
      ->add_option("--ttl", options->ttl_s, "Lease of the new session [s] (default: the server's)")
      ->check(CLI::Range(1.0, 86400.0))
      ->check(FiniteNumber())
      ->type_name("S")
      ->excludes(session);
  create
      ->add_option("--set", options->sets,
                   "Set a field of every cloth's spec, e.g. settings.substeps=8")
      ->allow_extra_args(false)
      ->type_name("PATH=VALUE");
  create->add_flag("--json", options->is_json, "Print JSON");
  create->callback([options, &action] { action = [options] { return Create(*options); }; });
}

}  // namespace drape::cli
