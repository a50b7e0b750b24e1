"""The bus over DDS, by Eclipse Cyclone DDS: reaches ROS nodes whose RMW is Cyclone DDS or Fast DDS."""
