// drape admin: what operators ask of a server.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/options.h"
#include "client/cli/output_file.h"
#include "client/cli/printable.h"
#include "drape/admin.h"

namespace drape::cli {
namespace {

using Rows = std::vector<std::vector<std::string>>;

struct AdminOptions {
  ServerAddress address;
  bool is_json = false;
  uint64_t number = 0;
  std::string level;
  double seconds = 5;
  std::string path;
};

// Columns as wide as what is in them; all but the first `left` are numbers.
void PrintTable(const Rows& rows, size_t left) {
  std::vector<size_t> widths;
  for (const auto& row : rows) {
    widths.resize(row.size());
    for (size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], row[k].size());
  }
  for (const auto& row : rows) {
    std::string line;
    for (size_t k = 0; k < row.size(); ++k) {
      const std::string space(widths[k] - row[k].size(), ' ');
      line += (k > 0 ? "  " : "") + (k < left ? row[k] + space : space + row[k]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    std::cout << line << "\n";
  }
}

std::string Short(double number) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", number);
  return text;
}

std::string Bytes(uint64_t bytes) {
  return Short(static_cast<double>(bytes) / 1e6) + " MB";
}

int ShowTenants(const AdminOptions& options) {
  const std::vector<v1::TenantUse> tenants = options.address.ConnectAdmin().ListTenants();
  if (options.is_json) {
    std::cout << MessagesJson(tenants) << "\n";
    return kDone;
  }
  Rows rows = {{"tenant", "sessions", "cloths", "particles", "saved", "answers", "unread",
                "steps waiting", "builds waiting", "particle-substeps/s", "limit", "wait",
                "builders", "limit", "wait"}};
  for (const v1::TenantUse& use : tenants) {
    rows.push_back(
        {use.name().empty() ? "(none)" : Printable(use.name()), std::to_string(use.session_count()),
         std::to_string(use.cloth_count()), std::to_string(use.particle_count()),
         Bytes(use.saved_bytes()), Bytes(use.remembered_bytes()), Bytes(use.unread_bytes()),
         std::to_string(use.queued_requests()), std::to_string(use.queued_builds()),
         Short(use.particle_substeps_per_s()),
         use.max_particle_substeps_per_s() > 0 ? Short(use.max_particle_substeps_per_s()) : "-",
         use.rate_wait_s() > 0 ? Short(use.rate_wait_s()) + " s" : "-",
         Short(use.builder_s_per_s()),
         use.max_builder_s_per_s() > 0 ? Short(use.max_builder_s_per_s()) : "-",
         use.builder_wait_s() > 0 ? Short(use.builder_wait_s()) + " s" : "-"});
  }
  PrintTable(rows, 1);
  return kDone;
}

int ShowSessions(const AdminOptions& options) {
  const std::vector<v1::TenantSession> sessions = options.address.ConnectAdmin().ListAllSessions();
  if (options.is_json) {
    std::cout << MessagesJson(sessions) << "\n";
    return kDone;
  }
  Rows rows = {{"number", "session", "tenant", "called", "cloths", "particles", "waiting", "left"}};
  for (const v1::TenantSession& session : sessions) {
    rows.push_back({std::to_string(session.number()), Printable(session.short_name()),
                    session.tenant().empty() ? "(none)" : Printable(session.tenant()),
                    Printable(session.display_name()), std::to_string(session.cloth_count()),
                    std::to_string(session.particle_count()),
                    std::to_string(session.queued_requests()),
                    Short(session.remaining_s()) + " s"});
  }
  PrintTable(rows, 4);
  return kDone;
}

int DropSession(const AdminOptions& options) {
  options.address.ConnectAdmin().DropSession(options.number);
  std::cout << "session " << options.number << " dropped\n";
  return kDone;
}

int Drain(const AdminOptions& options) {
  options.address.ConnectAdmin().Drain();
  std::cout << "the server drains\n";
  return kDone;
}

int WriteCheckpoints(const AdminOptions& options) {
  const auto written = options.address.ConnectAdmin().WriteCheckpoints();
  if (options.is_json) {
    std::cout << MessageJson(written) << "\n";
  } else {
    std::cout << written.session_count() << " sessions are on the disk, after "
              << Short(written.duration_s()) << " s\n";
  }
  return kDone;
}

int SetLogLevel(const AdminOptions& options) {
  const std::string former = options.address.ConnectAdmin().SetLogLevel(options.level);
  std::cout << "log level " << options.level << ", formerly " << former << "\n";
  return kDone;
}

int RecordTrace(const AdminOptions& options) {
  OutputFile file(options.path);
  const auto recorded = options.address.ConnectAdmin().RecordTrace(options.seconds);
  file.Write(recorded.json());
  file.Close();
  std::cout << options.path << ": " << recorded.events() << " events";
  if (recorded.events_left_out() > 0) {
    std::cout << ", and " << recorded.events_left_out() << " more that had no room";
  }
  std::cout << "\n";
  return kDone;
}

using AdminAction = int (*)(const AdminOptions&);

CLI::App* Add(CLI::App& admin, const std::string& name, const std::string& meaning,
              const std::shared_ptr<AdminOptions>& options, AdminAction act, Action& action) {
  CLI::App* command = admin.add_subcommand(name, meaning);
  options->address
      .AddTo(*command,
             "Its --admin-listen (HOST:PORT or unix:PATH), or with the token of an "
             "operator its --listen")
      ->required();
  command->callback([options, act, &action] { action = [options, act] { return act(*options); }; });
  return command;
}

}  // namespace

void AddAdmin(CLI::App& app, Action& action) {
  CLI::App* admin = app.add_subcommand("admin", "Look after a server: tenants, sessions, drain");
  admin->require_subcommand(1);
  const auto options = std::make_shared<AdminOptions>();
  const auto add = [&](const char* name, const char* meaning, AdminAction act) {
    return Add(*admin, name, meaning, options, act, action);
  };
  CLI::App* const tenants = add("tenants", "What each tenant has, and its rate", ShowTenants);
  CLI::App* const sessions = add("sessions", "The sessions of all tenants", ShowSessions);
  CLI::App* const checkpoint =
      add("checkpoint", "Write the sessions to the server's disk now", WriteCheckpoints);
  for (CLI::App* const command : {tenants, sessions, checkpoint}) {
    command->add_flag("--json", options->is_json, "Print JSON");
  }
  add("drop", "Delete a session and its cloths", DropSession)
      ->add_option("number", options->number, "Its number, as `drape admin sessions` prints it")
      ->type_name("NUMBER")
      ->required();
  add("drain", "End the server as SIGTERM does: accepted work is finished", Drain);
  CLI::App* const trace =
      add("trace", "Record what the server's threads do, for ui.perfetto.dev", RecordTrace);
  trace->add_option("file", options->path, "The JSON file to write")->type_name("FILE")->required();
  trace->add_option("--seconds", options->seconds, "How long (default: 5)")
      ->check(CLI::Range(0.001, 60.0))
      ->check(FiniteNumber())
      ->type_name("S");
  add("log-level", "Change what the server logs", SetLogLevel)
      ->add_option("level", options->level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->type_name("LEVEL")
      ->required();
}

}  // namespace drape::cli
