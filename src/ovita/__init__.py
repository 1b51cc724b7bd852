"""ovita: change how a robot moves by saying so."""
