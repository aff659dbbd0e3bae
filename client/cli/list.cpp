// drape list: the sessions of a server, or the cloths of a session.
#include <cstdio>
#include <iostream>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/options.h"
#include "client/cli/printable.h"

namespace drape::cli {
namespace {

struct ListOptions {
  ServerAddress address;
  std::string session;
  bool is_json = false;
};

void ListSessions(const Client& client, bool is_json) {
  const std::vector<v1::Session> sessions = client.ListSessions();
  if (is_json) {
    std::cout << MessagesJson(sessions) << "\n";
    return;
  }
  for (const v1::Session& session : sessions) {
    std::printf("%s: %u cloths, %lu particles, %.0f s left%s%s\n", session.name().c_str(),
                session.cloth_count(), session.particle_count(), session.remaining_s(),
                session.display_name().empty() ? "" : ", ", Printable(session.display_name()).c_str());
  }
}

void ListCloths(const Session& session, bool is_json) {
  const std::vector<v1::Cloth> cloths = session.ListCloths();
  if (is_json) {
    std::cout << MessagesJson(cloths) << "\n";
    return;
  }
  for (const v1::Cloth& cloth : cloths) {
    std::printf("cloth %lu: %u particles, %u constraints, step %lu, time %.6g s%s%s\n", cloth.id(),
                cloth.shape().particles(), cloth.shape().distance_constraints(), cloth.step(),
                cloth.time_s(), cloth.faulted() ? ", FAULTED: " : "", cloth.fault_reason().c_str());
  }
}

int List(const ListOptions& options) {
  const Client client = options.address.Connect();
  if (options.session.empty()) {
    ListSessions(client, options.is_json);
  } else {
    ListCloths(client.AttachSession(options.session), options.is_json);
  }
  return kDone;
}

}  // namespace

void AddList(CLI::App& app, Action& action) {
  CLI::App* list = app.add_subcommand("list", "List sessions, or the cloths of a session");
  auto options = std::make_shared<ListOptions>();
  options->address.AddTo(*list)->required();
  list->add_option("--session", options->session, "List the cloths of this session")
      ->type_name("NAME");
  list->add_flag("--json", options->is_json, "Print JSON");
  list->callback([options, &action] { action = [options] { return List(*options); }; });
}

}  // namespace drape::cli
