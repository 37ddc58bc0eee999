"""The devices: sound cards and wheels. Nothing here loads a device library before it is used."""
