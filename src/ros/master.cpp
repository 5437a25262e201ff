#include "tissue_sim/ros/master.h"

#include <ros/network.h>
#include <xmlrpcpp/XmlRpc.h>

namespace tissue_sim {
namespace {

struct Silence : XmlRpc::XmlRpcErrorHandler {
  void error(const char* /*message*/) override {}
};

}  // namespace

bool master_answers(const std::string& uri) {
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(uri, host, port)) return false;
  Silence silence;
  XmlRpc::XmlRpcErrorHandler* const loud = XmlRpc::XmlRpcErrorHandler::getErrorHandler();
  XmlRpc::XmlRpcErrorHandler::setErrorHandler(&silence);
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  XmlRpc::XmlRpcValue request, response;
  request[0] = "tissue_sim";
  const bool answers = client.execute("getPid", request, response);
  client.close();
  XmlRpc::XmlRpcErrorHandler::setErrorHandler(loud);
  return answers;
}

}  // namespace tissue_sim
