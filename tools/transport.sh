# Sourced with cell_tools set to the folder of this file: how messages travel, unless it is set
# already. Nobody has said how far a node is to be heard: by UDP, on this computer alone.
[ -n "${ROS_AUTOMATIC_DISCOVERY_RANGE:-}" ] || export ROS_AUTOMATIC_DISCOVERY_RANGE=SYSTEM_DEFAULT
# Who asks for a network gets sockets that hear it.
case $ROS_AUTOMATIC_DISCOVERY_RANGE in
  SYSTEM_DEFAULT | LOCALHOST) cell_profiles=$cell_tools/fastdds.xml ;;
  *) cell_profiles=$cell_tools/fastdds_network.xml ;;
esac
[ -n "${FASTRTPS_DEFAULT_PROFILES_FILE:-}" ] ||
  export FASTRTPS_DEFAULT_PROFILES_FILE="$cell_profiles"
[ -n "${FASTDDS_BUILTIN_TRANSPORTS:-}" ] || export FASTDDS_BUILTIN_TRANSPORTS=UDPv4
unset cell_profiles
