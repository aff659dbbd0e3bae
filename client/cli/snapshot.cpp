// drape snapshot, drape restore: the cloths of a session as a file, and such a file as cloths.
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>

#include "client/cli/commands.h"
#include "client/cli/options.h"
#include "client/cli/output_file.h"

namespace drape::cli {
namespace {

struct SnapshotOptions {
  SessionFlags target;
  std::string path;
};

int TakeSnapshot(const SnapshotOptions& options) {
  const Client client = options.target.address.Connect();
  const Session session = options.target.Attach(client);
  const std::string bytes = session.TakeSnapshot(options.target.cloths);
  OutputFile file(options.path);
  file.Write(bytes);
  file.Close();
  std::cout << options.path << ": " << bytes.size() << " bytes\n";
  return kDone;
}

struct RestoreOptions {
  std::string path;
  ServerAddress address;
  std::string session;
  std::optional<double> ttl_s;
  bool is_inexact = false;
};

Session OpenSession(const Client& client, const RestoreOptions& options) {
  if (!options.session.empty()) return client.AttachSession(options.session);
  SessionOptions session;
  session.ttl_s = options.ttl_s;
  session.display_name = "drape restore";
  session.renews_lease = false;
  return client.CreateSession(session);
}

int Restore(const RestoreOptions& options) {
  std::ifstream file(options.path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const Client client = options.address.Connect();
  Session session = OpenSession(client, options);
  const RestoredCloths restored = session.Restore(bytes, options.is_inexact);
  session.Detach();
  std::cout << "session " << session.name() << "\n";
  for (size_t k = 0; k < restored.cloths.size(); ++k) {
    std::cout << "cloth " << restored.cloths[k] << ", formerly " << restored.former_cloths[k]
              << "\n";
  }
  return kDone;
}

}  // namespace

void AddSnapshot(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "snapshot", "Write cloths of a session to a file from which they go on with the same bits");
  auto options = std::make_shared<SnapshotOptions>();
  command->add_option("file", options->path, "The file to write")->type_name("FILE")->required();
  options->target.AddTo(*command);
  command->callback([options, &action] { action = [options] { return TakeSnapshot(*options); }; });
}

void AddRestore(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("restore", "Make cloths of a file that snapshot has written");
  auto options = std::make_shared<RestoreOptions>();
  command->add_option("file", options->path, "The file to read")
      ->type_name("FILE")
      ->check(CLI::ExistingFile)
      ->required();
  options->address.AddTo(*command)->required();
  auto* session = command->add_option("--session", options->session,
                                      "Put them into this session (default: a new one)");
  session->type_name("NAME");
  command
      ->add_option("--ttl", options->ttl_s, "Lease of the new session [s] (default: the server's)")
      ->check(CLI::Range(1.0, 86400.0))
      ->check(FiniteNumber())
      ->type_name("S")
      ->excludes(session);
  command->add_flag("--inexact", options->is_inexact,
                    "Accept a file of another build, backend or device: not the same bits");
  command->callback([options, &action] { action = [options] { return Restore(*options); }; });
}

}  // namespace drape::cli
